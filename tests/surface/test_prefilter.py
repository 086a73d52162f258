"""The mean over a footprint: unbiased, as noisy as it says, and the closed forms that simple materials have."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.sampling.footprints import turned_footprint
from jaxbrdf.surface.prefilter import FILTER_DEVIATION, gaussian_point, prefiltered, reference
from jaxbrdf.types import Query

FOOTPRINT = turned_footprint(jnp.float32(0.3), jnp.float32(0.1), jnp.float32(0.5))
WAVES = jnp.array([[1.0, 2.0], [2.0, -1.0], [0.0, 3.0]])


def waves(params: jax.Array, query: Query) -> jax.Array:
    """One wave 1 + cos(2 pi k . uv) a channel, k the rows of the parameters."""
    phase = query.uv[..., 0, None] * params[:, 0][None] + query.uv[..., 1, None] * params[:, 1][None]
    return 1.0 + jnp.cos(2.0 * jnp.pi * phase)


def filtered_waves(query: Query) -> np.ndarray:
    """A Gaussian of covariance S damps a wave k by exp(-2 pi^2 k S k), S = J J^T / 4."""
    j = np.asarray(query.footprint, float)
    covariance = FILTER_DEVIATION**2 * j @ np.swapaxes(j, -1, -2)
    k = np.asarray(WAVES, float)
    damped = np.exp(-2.0 * np.pi**2 * np.einsum("ca,nab,cb->nc", k, covariance, k))
    return 1.0 + damped * np.cos(2.0 * np.pi * np.asarray(query.uv, float) @ k.T)


def queries(count: int) -> Query:
    up = jnp.broadcast_to(jnp.array([0.0, 0.0, 1.0]), (count, 3))
    uv = jax.random.uniform(jax.random.key(3), (count, 2))
    return Query(up, up, uv, jnp.broadcast_to(FOOTPRINT, (count, 2, 2)))


@pytest.mark.parametrize("samples", [1, 16])
def test_it_is_unbiased(samples: int):
    query = queries(64)
    estimate = jax.jit(prefiltered(waves, samples=samples))
    values = np.stack([estimate(jax.random.key(seed), WAVES, query) for seed in range(400)]).astype(float)
    error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    deviation = (values.mean(axis=0) - filtered_waves(query)) / error
    # 192 comparisons: four and a half standard errors once in a thousand runs
    assert np.abs(deviation).max() < 4.5
    assert 0.7 < deviation.std() < 1.3


def test_even_points_have_less_noise():
    query = queries(64)

    def spread(samples: int) -> float:
        estimate = jax.jit(prefiltered(waves, samples=samples))
        return float(np.stack([estimate(jax.random.key(s), WAVES, query) for s in range(50)]).std(axis=0).mean())

    assert spread(64) < 0.5 * spread(1) / 8.0


def test_the_reference_reaches_the_error_that_it_is_asked_for():
    query = queries(32)
    found = reference(jax.random.key(1), waves, WAVES, query, error=1e-3, samples=64)
    assert float(jnp.max(found.standard_error / (found.value + 1e-3))) <= 1e-3
    assert np.abs((np.asarray(found.value, float) - filtered_waves(query)) / np.asarray(found.standard_error)).max() < 6


def test_the_reference_stops_and_says_what_it_reached():
    found = reference(jax.random.key(1), waves, WAVES, queries(4), error=1e-9, samples=2, most_shifts=8)
    assert 1e-9 < float(jnp.max(found.standard_error)) < 1.0


def test_no_footprint_is_the_point():
    query = queries(8)._replace(footprint=None)
    np.testing.assert_array_equal(prefiltered(waves, samples=16)(jax.random.key(0), WAVES, query), waves(WAVES, query))


def test_points_are_those_of_the_unit_filter():
    x = np.asarray(gaussian_point(jax.random.uniform(jax.random.key(0), (200_000, 2))), float)
    np.testing.assert_allclose(np.cov(x.T), FILTER_DEVIATION**2 * np.eye(2), atol=4e-3)
    assert np.isfinite(np.asarray(gaussian_point(jnp.array([[0.0, 0.0], [1.0 - 6e-8, 0.5]])))).all()


def test_no_samples_are_refused():
    with pytest.raises(ValueError, match="count is 0"):
        prefiltered(waves, samples=0)
