"""Footprints as Eq. 9 has them: the range and the crowding of their size, their length and their direction."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from jaxbrdf.sampling.footprints import draw_places, footprint_scale, turned_footprint

COUNT, TEXELS = 20_000, 1024


def drawn(cos: float) -> tuple[np.ndarray, np.ndarray]:
    wo = jnp.broadcast_to(jnp.array([np.sqrt(1 - cos * cos), 0.0, cos], jnp.float32), (COUNT, 3))
    return tuple(np.asarray(part, float) for part in draw_places(jax.random.key(0), wo, texels=TEXELS))


def test_the_scale_runs_as_the_paper_has_it():
    scale = np.log2(np.asarray(footprint_scale(jnp.array([0.0, 0.5, 1.0 - 6e-8]), texels=TEXELS), float))
    middle = -13 + 14 * np.expm1(2.5) / np.expm1(5)
    np.testing.assert_allclose(scale, [-13.0, middle, 1.0], atol=1e-4)


def test_places_are_uniform():
    uv, _ = drawn(0.5)
    for axis in range(2):
        assert stats.kstest(uv[:, axis], "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(uv.T)[0, 1]) < 4 / np.sqrt(COUNT)


def test_a_slanted_view_is_longer_by_its_secant():
    for cos in (1.0, 0.5, 0.2):
        long, short = np.linalg.svd(drawn(cos)[1], compute_uv=False).T
        # 1 + z is a normal variable about one, and the longer axis is the secant's while it exceeds the shorter
        ratio = np.sort(np.stack([long / short, short / long]), axis=0)[1]
        want = 1.0 / cos * np.abs(1.0 + 0.2 * np.random.default_rng(1).normal(size=COUNT))
        want = np.maximum(want, 1.0 / want)
        assert abs(np.median(ratio) / np.median(want) - 1.0) < 0.02


def test_directions_are_uniform():
    footprint = drawn(0.1)[1]
    angle = np.arctan2(footprint[:, 1, 0], footprint[:, 0, 0]) / np.pi % 1.0
    assert stats.kstest(angle, "uniform").pvalue > 1e-3


def test_a_turned_footprint_is_rotation_after_stretching():
    found = np.asarray(turned_footprint(jnp.array(3.0), jnp.array(0.5), jnp.array(0.7)), float)
    c, s = np.cos(0.7), np.sin(0.7)
    np.testing.assert_allclose(found, np.array([[c, -s], [s, c]]) @ np.diag([3.0, 0.5]), rtol=1e-6)


def test_grazing_viewers_have_finite_footprints():
    uv, footprint = draw_places(jax.random.key(1), jnp.array([[1.0, 0.0, 0.0]]), texels=4)
    assert np.isfinite(uv).all()
    assert np.isfinite(footprint).all()


def test_footprints_that_are_not_stretched_are_round():
    wo = jnp.tile(jnp.array([0.6, 0.0, 0.8]), (64, 1))
    _, footprint = draw_places(jax.random.key(3), wo, texels=256, stretched=False)
    squares = np.asarray(footprint @ footprint.swapaxes(-1, -2))
    e_squared = squares[:, :1, :1]
    np.testing.assert_allclose(squares, e_squared * np.eye(2), atol=1e-6 * e_squared.max())
    assert np.ptp(np.log2(e_squared)) > 4.0
