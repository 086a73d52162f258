"""Multiple importance sampling: partition of unity, extremes, and an integral that neither sampler gets alone."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.sampling.mis import balance_heuristic, power_heuristic

DENSITIES = jnp.array([0.0, 1e-30, 1e-10, 0.3, 1.0, 7.0, 1e10, 1e25, 1e37])


@pytest.mark.parametrize("heuristic", [balance_heuristic, power_heuristic])
def test_weights_sum_to_one_wherever_anything_is_drawn(heuristic):
    a, b = (x.ravel() for x in jnp.meshgrid(DENSITIES, DENSITIES))
    total = heuristic(a, b) + heuristic(b, a)
    np.testing.assert_allclose(total, (np.asarray(a + b) > 0).astype(float), rtol=1e-6)


def test_power_heuristic_squares():
    np.testing.assert_allclose(power_heuristic(jnp.float32(3.0), jnp.float32(1.0)), 0.9, rtol=1e-6)
    np.testing.assert_allclose(balance_heuristic(jnp.float32(3.0), jnp.float32(1.0)), 0.75, rtol=1e-6)


@pytest.mark.parametrize("heuristic", [balance_heuristic, power_heuristic])
def test_combined_estimate_is_unbiased(heuristic):
    # x^2 over [0, 1] from densities 1 and 4 x^3
    u, v = jax.random.uniform(jax.random.key(0), (2, 200_000))
    y = v**0.25
    flat = u**2 * heuristic(jnp.ones_like(u), 4 * u**3)
    steep = y**2 / (4 * y**3) * heuristic(4 * y**3, jnp.ones_like(y))
    term = np.asarray(flat + steep, float)
    assert abs(term.mean() - 1 / 3) < 4 * term.std() / np.sqrt(len(term))
