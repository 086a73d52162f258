"""Energy-preserving Oren-Nayar: Lambert's limit, the furnace, a published value, what every lobe is tested for."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.oren_nayar import OREN_NAYAR, OrenNayarParams
from jaxbrdf.checks.chi_square import significance_of_each
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.types import Brdf, Query
from tests.brdf import lobes

COLOUR = (1.0, 0.5, 0.02)
ROUGHNESS = (0.0, 0.3, 1.0)


def rough(roughness: float, colour: tuple[float, float, float] = COLOUR) -> OrenNayarParams:
    return OrenNayarParams(jnp.array(colour), jnp.array(roughness))


@pytest.mark.parametrize("roughness", ROUGHNESS)
def test_common_checks(roughness: float):
    lobes.assert_finite_and_reciprocal(OREN_NAYAR, rough(roughness))
    lobes.assert_finite_and_reciprocal(OREN_NAYAR, rough(roughness, (0.0, 0.0, 0.0)))
    lobes.assert_float32_is_enough(OREN_NAYAR, rough(roughness), relative=3e-6)
    level = significance_of_each(0.01, len(ROUGHNESS) * len(lobes.VIEWERS))
    lobes.assert_sampler_is_exact(OREN_NAYAR, rough(roughness), level)


def test_it_is_lambert_where_smooth():
    query = lobes.pairs(2000, 3)
    want = LAMBERT.eval(LambertParams(jnp.array(COLOUR)), query)
    np.testing.assert_allclose(lobes.EVAL(OREN_NAYAR, rough(0.0), query), want, rtol=2e-7)


@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("theta", [0.0, 0.5, 1.0, 1.4, 1.57])
def test_a_white_body_reflects_everything(roughness: float, theta: float):
    found = lobes.albedo_by_quadrature(OREN_NAYAR, rough(roughness, (1.0, 1.0, 1.0)), theta)
    np.testing.assert_allclose(found, 1.0, atol=1e-4)


@pytest.mark.parametrize("roughness", [0.2, 1.0])
def test_albedo_is_the_integral(roughness: float):
    for theta in (0.0, 0.7, 1.3, 1.57):
        wo = lobes.viewer(theta)
        want = lobes.albedo_by_quadrature(OREN_NAYAR, rough(roughness), theta)
        np.testing.assert_allclose(lobes.ALBEDO(OREN_NAYAR, rough(roughness), Query(wo, wo)), want, rtol=3e-5)
    lobes.assert_draws_carry_the_albedo(OREN_NAYAR, rough(roughness))


def test_retroreflection_at_the_published_value():
    """Single scattering at 45 degrees towards the viewer: s = 1/2, t = sqrt(1/2), so A (1 + r sqrt(1/2)) / pi.

    With an albedo so small that nothing scatters twice, A(1) = 1 / 1.2877934 (Portsmouth et al. 2025).
    """
    w = jnp.array([np.sqrt(0.5), 0.0, np.sqrt(0.5)], jnp.float32)
    f = OREN_NAYAR.eval(rough(1.0, (1e-6, 1e-6, 1e-6)), Query(w, w))
    np.testing.assert_allclose(f, 1e-6 / np.pi * (1 + np.sqrt(0.5)) / 1.2877934, rtol=1e-5)


def test_draws_vary_less_than_the_cosines():
    wo = lobes.viewer(1.45)
    by_cosine = Brdf(OREN_NAYAR.eval)
    own = directional_albedo(jax.random.key(0), OREN_NAYAR, rough(1.0), wo)
    plain = directional_albedo(jax.random.key(0), by_cosine, rough(1.0), wo)
    assert np.all(own.standard_error < 0.5 * plain.standard_error)
