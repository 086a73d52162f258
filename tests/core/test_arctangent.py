from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.arctangent import fast_atan2

ONES = np.array([0.0, -0.0, 1.0, -1.0], np.float32)


def test_agrees_with_numpy_in_every_octant_and_magnitude() -> None:
    rng = np.random.default_rng(0)
    y, x = (rng.normal(size=200_000) * 10.0 ** rng.uniform(-12, 12, 200_000) for _ in range(2))
    y, x = y.astype(np.float32), x.astype(np.float32)
    exact = np.arctan2(y.astype(np.float64), x.astype(np.float64))
    error = np.abs(np.asarray(jax.jit(fast_atan2)(y, x)) - exact) / np.maximum(np.abs(exact), 1e-30)
    assert error.max() < 4e-7


def test_axes_and_signed_zeros() -> None:
    y, x = (a.reshape(-1) for a in np.meshgrid(ONES, np.array([1.0, -1.0], np.float32)))
    # rounded once: numpy's own single precision is half a unit further off where it has vector instructions for it
    exact = np.arctan2(y.astype(np.float64), x.astype(np.float64)).astype(np.float32)
    np.testing.assert_array_equal(fast_atan2(jnp.asarray(y), jnp.asarray(x)), exact)
    np.testing.assert_array_equal(fast_atan2(jnp.zeros(1), jnp.zeros(1)), 0.0)


def test_gradient_agrees_with_the_exact_one() -> None:
    y, x = jnp.array([0.3, -2.0, 0.5, -0.1]), jnp.array([1.0, 0.7, -3.0, -0.2])
    slope = jax.vmap(jax.grad(fast_atan2, argnums=(0, 1)))(y, x)
    np.testing.assert_allclose(slope[0], x / (x * x + y * y), rtol=1e-4)
    np.testing.assert_allclose(slope[1], -y / (x * x + y * y), rtol=1e-4)
