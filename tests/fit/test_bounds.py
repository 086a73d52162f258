"""Bounds by transformation: they hold for any number, and every valid parameter can be had."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.ranges import ANY, Range
from jaxbrdf.fit.bounds import EDGE, from_free, to_free

RANGES = {"share": (0.0, 1.0), "rough": (1e-4, 1.0), "size": (2.0, np.inf), "turn": (-np.inf, np.inf)}


class Mixed(NamedTuple):
    """A parameter of each kind of range."""

    share: Annotated[jax.Array, Range(0.0, 1.0)]
    rough: Annotated[jax.Array, Range(1e-4, 1.0)]
    size: Annotated[jax.Array, Range(2.0, np.inf)]
    turn: Annotated[jax.Array, ANY]


@pytest.mark.parametrize("t", [-80.0, -3.0, 0.0, 2.0, 80.0])
def test_any_number_gives_a_valid_parameter(t: float):
    found = from_free(Mixed(*[jnp.array(t)] * 4))
    for name, (low, high) in RANGES.items():
        # to float32's rounding of the ends
        assert np.float32(low) <= getattr(found, name) <= np.float32(high)


def test_parameters_come_back():
    given = Mixed(jnp.array([0.2, 0.9]), jnp.array(0.03), jnp.array(7.5), jnp.array(-40.0))
    for back, value in zip(from_free(to_free(given)), given, strict=True):
        np.testing.assert_allclose(back, value, rtol=1e-5)


def test_ends_of_a_range_can_start():
    """A start at an end is taken a little inside, where the transformation has a slope."""
    found = to_free(Mixed(jnp.array([0.0, 1.0]), jnp.array(1e-4), jnp.array(2.0), jnp.array(0.0)))
    assert all(np.isfinite(leaf).all() for leaf in found)
    np.testing.assert_allclose(from_free(found).share, [EDGE, 1.0 - EDGE], rtol=1e-3)


def test_wide_ranges_are_walked_by_factors():
    middle = from_free(Mixed(*[jnp.array(0.0)] * 4))
    np.testing.assert_allclose([middle.share, middle.rough], [0.5, 1e-2], rtol=1e-5)
