"""Values and gradients of every model over a surface are finite on hard directions, places and footprints."""

from __future__ import annotations

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.checks.hard import hard_queries
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.types import Query
from tests.models.surfaces import random_params, small

FOOTPRINTS = {
    "zero": np.zeros((2, 2)),
    "singular": np.array([[0.1, 0.2], [0.05, 0.1]]),
    "huge": np.full((2, 2), 1e30),
    "infinite": np.array([[np.inf, 0.0], [0.0, 0.1]]),
    "tiny": np.array([[1e-30, 0.0], [0.0, 1e-38]]),
}


def hard(footprint: np.ndarray) -> Query:
    """The hard directions, at hard places."""
    directions = hard_queries()
    count = len(directions.wi)
    uv = np.resize([[0.0, 1.0], [0.5, 0.5], [-0.0, 1e6], [1e-30, -3.0], [0.49999997, 1 / 3]], (count, 2))
    footprints = jnp.broadcast_to(jnp.asarray(footprint, jnp.float32), (count, 2, 2))
    return directions._replace(uv=jnp.asarray(uv, jnp.float32), footprint=footprints)


@cache
def gradients(name: str):
    def total(params, wi: jax.Array, wo: jax.Array, query: Query) -> tuple[jax.Array, jax.Array]:
        f = small(name).eval(params, query._replace(wi=wi, wo=wo))
        return jnp.sum(f), f

    return jax.jit(jax.grad(total, argnums=(0, 1, 2), has_aux=True))


@pytest.mark.parametrize("footprint", FOOTPRINTS)
@pytest.mark.parametrize("name", SPATIAL)
def test_values_and_gradients_hold_on_hard_queries(name: str, footprint: str):
    holds(name, hard(FOOTPRINTS[footprint]))


@pytest.mark.parametrize("name", ["tripleplane", "neumip"])
def test_values_and_gradients_hold_without_a_footprint(name: str):
    holds(name, hard(FOOTPRINTS["zero"])._replace(footprint=None))


def holds(name: str, query: Query) -> None:
    """At first parameters and at random ones, whose values reach 1e5."""
    for params in (small(name).init(jax.random.key(0)), random_params(6, small(name), deviation=1.0)):
        slopes, f = gradients(name)(params, query.wi, query.wo, query)
        lit = np.asarray((query.wi[:, 2] > 0) & (query.wo[:, 2] > 0))
        assert np.isfinite(f).all()
        assert (f >= 0).all()
        assert not f[~lit].any()
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(slopes))
