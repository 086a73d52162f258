from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.models import warp

R = np.concatenate([[0.0, 1.0], np.geomspace(1e-12, 1.0, 64)]).astype(np.float32)


def test_first_exponents_are_those_asked_for():
    params = warp.init((0.75, 1.0, 3.0))
    shares, exponents = warp.shares_and_exponents(params)
    np.testing.assert_allclose(shares, np.full(3, 1 / 3), rtol=1e-6)
    np.testing.assert_allclose(exponents, [0.75, 1.0, 3.0], rtol=1e-6)


def test_ones_are_the_identity():
    np.testing.assert_allclose(warp.apply(warp.init((1.0, 1.0)), jnp.asarray(R)), R, rtol=5e-6, atol=1e-30)


@pytest.mark.parametrize("logits", [[0.3, -1.2], [80.0, -80.0]])
@pytest.mark.parametrize("exponents", [[-30.0, 2.0], [0.1, 40.0]])
def test_a_warp_is_the_sum_of_powers_and_keeps_the_ends(logits: list[float], exponents: list[float]):
    params = warp.RadialWarp(jnp.asarray(logits), jnp.asarray(exponents))
    shares = np.exp(logits) / np.exp(logits).sum()
    alpha = 0.5 + np.log1p(np.exp(exponents))
    wanted = (shares * R.astype(np.float64)[:, None] ** alpha).sum(-1)
    found = np.asarray(warp.apply(params, jnp.asarray(R)))
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=1e-18)
    assert found[0] < 1e-18
    assert found[1] == pytest.approx(1.0, rel=1e-6)
    assert (np.diff(found[2:]) >= -1e-7).all()


def test_slopes_are_finite_at_the_centre():
    def total(params: warp.RadialWarp, r: jax.Array) -> jax.Array:
        return warp.apply(params, r).sum()

    params = warp.RadialWarp(jnp.zeros(2), jnp.asarray([-5.0, 1.0]))
    by_params, by_radius = jax.grad(total, argnums=(0, 1))(params, jnp.asarray([0.0, 1e-38, 1e-20, 1.0]))
    assert all(np.isfinite(leaf).all() for leaf in (*by_params, by_radius))
