from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import expit

from jaxbrdf.models import mlp

X = np.concatenate([np.linspace(-20, 20, 81), [-1e4, -90.0, 90.0, 1e4]]).astype(np.float32)


def test_silu_and_its_slope_are_those_of_the_formula_far_out_too():
    """Against scipy's logistic function in float64; the slope of x s(x) is s + x s (1 - s)."""
    x = X.astype(np.float64)
    s, complement = expit(x), expit(-x)
    np.testing.assert_allclose(jax.jit(mlp.silu)(jnp.asarray(X)), x * s, rtol=3e-6, atol=1e-36)
    slope = jax.jit(jax.grad(lambda x: mlp.silu(x).sum()))(jnp.asarray(X))
    # near x = -1.28 the terms cancel, so that the bound there is absolute
    np.testing.assert_allclose(slope, s + x * s * complement, rtol=3e-6, atol=1e-7)


@pytest.mark.parametrize("hidden", [(), (5,), (4, 3)])
def test_a_network_is_matrix_products_with_silu_between(hidden: tuple[int, ...]):
    params = mlp.init(jax.random.key(0), (6, *hidden, 2))
    biases = tuple(jnp.linspace(-1.0, 1.0, b.size) for b in params.biases)
    x = np.random.default_rng(0).normal(size=(6, 50))
    wanted = x
    for layer, (weight, bias) in enumerate(zip(params.weights, biases, strict=True)):
        wanted = np.asarray(weight, np.float64).T @ wanted + np.asarray(bias, np.float64)[:, None]
        wanted = wanted * expit(wanted) if layer < len(hidden) else wanted
    found = mlp.apply(mlp.Mlp(params.weights, biases), jnp.asarray(x, jnp.float32))
    np.testing.assert_allclose(found, wanted, rtol=2e-5, atol=2e-6)
