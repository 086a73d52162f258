"""Starts of every analytic model, and what its configuration leaves out."""

from __future__ import annotations

from functools import partial

import jax
import numpy as np
import pytest

from jaxbrdf.core.ranges import check_ranges, ranges_of
from jaxbrdf.models.ggx import BareGgxConfig, start_ggx
from jaxbrdf.models.principled import PrincipledConfig, start_principled
from jaxbrdf.models.table import ANALYTIC


@pytest.mark.parametrize("isotropic", [True, False])
@pytest.mark.parametrize("model", ANALYTIC)
def test_starts_are_valid_and_spread(model: str, isotropic: bool):
    entry = ANALYTIC[model]
    start = partial(entry.start, config=entry.config(isotropic=isotropic))
    starts = jax.vmap(start)(jax.random.split(jax.random.key(0), 100))
    check_ranges(starts)
    for leaf, valid in zip(jax.tree.leaves(starts), ranges_of(starts), strict=True):
        assert np.ptp(leaf) > 0.02 * (valid.high - valid.low if np.isfinite(valid.high) else 1.0) or valid.high == 1e3


def test_what_is_not_configured_is_not_there():
    assert start_ggx(jax.random.key(0), BareGgxConfig()).albedo is None
    bare = PrincipledConfig(metallic=False, spec_tint=False, sheen=False, flatness=False, clearcoat=False)
    assert len(jax.tree.leaves(start_principled(jax.random.key(0), bare))) == 3
    general = PrincipledConfig(isotropic=False)
    assert start_principled(jax.random.key(0), general).anisotropic is not None
