"""A part of experiments/check_brdfs_against_mitsuba.py: closed forms against Mitsuba's plugins, a query at a time."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from experiments.check_brdfs_against_mitsuba import Answer, cases, draw_queries, lit, ours
from jaxbrdf.types import Query
from tests.brdf.mitsuba_bsdfs import one_by_one

NAMES = (
    "roughconductor ggx 0.01 0.01",
    "roughconductor ggx 0.08 0.35",
    "roughconductor beckmann 0.08 0.35",
    "roughconductor beckmann 1 1",
    "roughdielectric ggx 0.4",
    "roughplastic ggx 0.05, interface",
    "plastic, body",
    "diffuse",
)


@pytest.fixture(scope="module")
def query() -> Query:
    return draw_queries(400, 1)


@pytest.mark.parametrize("name", NAMES)
def test_value_and_density(name: str, query: Query, mitsuba_rgb):
    case = cases()[name]
    theirs = one_by_one(mitsuba_rgb, case.plugin, query, lobes=case.lobes)
    mine, kept = ours(case.brdf, case.params, query), lit(theirs)
    assert kept.mean() > 0.3
    factor = case.factor(query) if case.factor else Answer(np.ones((len(kept), 1)), np.ones(len(kept)))
    # Beckmann's exponent reaches 46 where Mitsuba cuts it, and its rounding is 46 times float32's
    np.testing.assert_allclose((mine.value * factor.value)[kept], theirs.value[kept], rtol=2e-5)
    # the density's 1 / (4 wo . wh) has the directions' own rounding over cos_d, 6e-5 at cosines of 1e-3
    np.testing.assert_allclose((mine.density * factor.density)[kept], theirs.density[kept], rtol=2e-4)
    assert np.max(mine.value[~kept], initial=0.0) < 1e-15


def test_pairs_are_demanding(query: Query):
    """Half of them lie about the mirror direction, where lobes are sharp."""
    both = np.asarray(query.wi + query.wo, float)
    sin_h = np.hypot(both[:, 0], both[:, 1]) / np.linalg.norm(both, axis=-1)
    assert jax.tree.leaves(query)[0].shape == (400, 3)
    assert np.mean(sin_h < 0.05) > 0.2
