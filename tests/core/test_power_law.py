"""The power law's mass against quadrature, and its draws against the mass below them."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate

from jaxbrdf.core.power_law import power_draw, power_mass

EXPONENTS = (0.0, 0.5, 1.0 - 1e-6, 1.0, 1.0 + 1e-3, 2.0, 10.0)


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("log_end", [1e-4, 1.0, 16.0])
def test_mass_is_the_integral(log_end: float, exponent: float):
    want = integrate.quad(lambda s: np.exp((1.0 - exponent) * s), 0.0, log_end, epsabs=0.0)[0]
    np.testing.assert_allclose(power_mass(jnp.float32(log_end), jnp.float32(exponent)), want, rtol=3e-6)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_the_share_below_a_draw_is_its_u(exponent: float):
    u, end, p = jnp.linspace(0.0, 0.999, 101), jnp.float32(9.0), jnp.float32(exponent)
    drawn = power_draw(end, p, u)
    np.testing.assert_allclose(power_mass(drawn, p) / power_mass(end, p), u, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_the_slope_by_the_exponent_is_finite_and_right(exponent: float):
    with jax.enable_x64(True):
        slope = jax.grad(lambda p: power_mass(jnp.float64(3.0), p))(jnp.float64(exponent))
    want = integrate.quad(lambda s: -s * np.exp((1.0 - exponent) * s), 0.0, 3.0, epsabs=0.0)[0]
    np.testing.assert_allclose(slope, want, rtol=1e-4)
