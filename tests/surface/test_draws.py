"""Draws of training: targets are unbiased whatever their number of points, and light finds the highlights."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.directions import above_horizon
from jaxbrdf.sampling.footprints import COARSEST, FINEST_TEXELS
from jaxbrdf.surface.draws import SurfaceDraws, Targets, draw_targets
from jaxbrdf.surface.prefilter import prefiltered
from jaxbrdf.surface.textured import reciprocal_textured
from tests.surface.relief import relief

SIZE, COUNT = 16, 512


def drawn(config: SurfaceDraws, seed: int) -> Targets:
    layout, texels = relief(SIZE)
    return jax.jit(draw_targets(layout, config), static_argnums=2)(jax.random.key(seed), texels, COUNT)


def test_targets_are_unbiased_given_their_queries():
    """Also where the light was drawn at a point of the footprint: over queries, (target - mean) / mean sums to zero."""
    layout, texels = relief(SIZE)
    estimate = jax.jit(prefiltered(reciprocal_textured(layout).eval, samples=1024))
    off = []
    for seed in range(8):
        found = drawn(SurfaceDraws(samples=2), seed)
        mean = estimate(jax.random.key(seed + 100), texels, found.query)
        off.append(np.asarray((found.f - mean) / (mean + 1e-2)))
    means = np.array([one.mean() for one in off])
    assert np.concatenate(off).std() > 0.05, "targets without noise would prove nothing"
    assert abs(means.mean()) < 4.0 * means.std(ddof=1) / np.sqrt(len(means))


def test_light_is_scattered_to_where_the_surface_is_bright():
    """Means of f itself, which light that is drawn as it scatters sees more of."""
    bright, even = (drawn(SurfaceDraws(samples=16, scattered=s), 0) for s in (True, False))
    half = COUNT // 2
    assert float(jnp.mean(bright.f[:half])) > 2.0 * float(jnp.mean(even.f[:half]))
    np.testing.assert_array_equal(bright.query.wi[half:], even.query.wi[half:])
    assert bool(jnp.all(above_horizon(bright.query.wi, bright.query.wo)))


def test_footprints_are_within_their_range_and_finer_ones_more_often_with_more_crowding():
    scales = {}
    for crowding in (1e-3, 5.0):
        footprint = drawn(SurfaceDraws(samples=1, crowding=crowding), 1).query.footprint
        scales[crowding] = np.log2(np.linalg.norm(np.asarray(footprint)[..., 1], axis=-1))
    low, high = np.log2(FINEST_TEXELS / SIZE), COARSEST
    for scale in scales.values():
        assert low - 1e-3 <= scale.min()
        assert scale.max() <= high + 1e-3
    # evenly spread without crowding: the mean is the middle within 4 standard errors
    assert abs(scales[1e-3].mean() - 0.5 * (low + high)) < 4.0 * (high - low) / np.sqrt(12 * COUNT)
    assert scales[5.0].mean() < 0.5 * (low + high) - 1.0


def test_a_target_needs_a_point():
    with pytest.raises(ValueError, match="count is 0; it must be at least 1"):
        draw_targets(relief(SIZE)[0], SurfaceDraws(samples=0))
