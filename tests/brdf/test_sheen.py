"""The Charlie sheen: its published terms, energy, the polynomial of its albedo, what every lobe is tested for."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.sheen import LEAST_ROUGHNESS, SHEEN, SheenParams
from jaxbrdf.checks.chi_square import significance_of_each
from jaxbrdf.core.directions import spherical
from jaxbrdf.types import Query
from tests.brdf import lobes

ROUGHNESS = (LEAST_ROUGHNESS, 0.3, 1.0)


def fibres(roughness: float, colour: tuple[float, float, float] = (1.0, 0.5, 0.1)) -> SheenParams:
    return SheenParams(jnp.array(colour), jnp.array(roughness))


@pytest.mark.parametrize("roughness", ROUGHNESS)
def test_common_checks(roughness: float):
    lobes.assert_finite_and_reciprocal(SHEEN, fibres(roughness))
    lobes.assert_float32_is_enough(SHEEN, fibres(roughness))
    level = significance_of_each(0.01, len(ROUGHNESS) * len(lobes.VIEWERS))
    lobes.assert_sampler_is_exact(SHEEN, fibres(roughness), level)
    lobes.assert_draws_carry_the_albedo(SHEEN, fibres(roughness))


def test_the_distribution_has_its_closed_form():
    """wi = wo at theta: wh is wo, and f (4 cos^2) (1 + 2 Lambda) = D.

    Lambda(1/2) at roughness 1 by the numbers of Estevez and Kulla (2017).
    """
    w = spherical(jnp.array(np.pi / 3, jnp.float32), jnp.array(0.2))
    log_lambda = 21.5473 / (1 + 3.82987 * 0.5**0.19823) - 0.9888 - 4.32054
    want = 3 * np.sqrt(0.75) / (2 * np.pi) / (1 + 2 * np.exp(log_lambda))
    np.testing.assert_allclose(SHEEN.eval(fibres(1.0, (1.0, 1.0, 1.0)), Query(w, w)), want, rtol=1e-5)


@pytest.mark.parametrize("roughness", [LEAST_ROUGHNESS, 0.1, 0.2, 0.45, 1.0])
def test_albedo_is_the_integral_and_at_most_one(roughness: float):
    """At 1e-6 from the horizon too, where the published fit of Lambda gains energy."""
    for theta in (0.0, 0.6, 1.2, 1.5, 1.56, 0.5 * np.pi - 1e-3, 0.5 * np.pi - 1e-6):
        wo = jnp.array([np.sin(theta), 0.0, np.cos(theta)], jnp.float32)
        want = lobes.albedo_by_quadrature(SHEEN, fibres(roughness), theta)
        assert np.all(want < 1.0)
        found = lobes.ALBEDO(SHEEN, fibres(roughness), Query(wo, wo))
        np.testing.assert_allclose(found, want, atol=2e-3)
        assert np.all(found < 1.0)


def test_roughness_below_its_range_is_the_least():
    query = lobes.pairs(200, 4)
    np.testing.assert_array_equal(
        lobes.EVAL(SHEEN, fibres(0.01), query), lobes.EVAL(SHEEN, fibres(LEAST_ROUGHNESS), query)
    )


def test_nothing_leaves_a_viewer_below():
    wo = jnp.array([0.6, 0.0, -0.8])
    assert not np.any(lobes.ALBEDO(SHEEN, fibres(0.3), Query(wo, wo)))
