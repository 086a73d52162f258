"""The energy scale: no direction gives more than it gets, nothing is taken where that holds, reciprocity stays."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.energy_scale import KNOTS, EnergyScale, log2_loss, scale_terms, scaled
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.principled import PRINCIPLED, PrincipledParams
from jaxbrdf.checks.rings import albedo_by_rings
from jaxbrdf.core.grazing import grazing, view_at
from jaxbrdf.fit.energy import fit_energy_scale
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Query

WHITE = PrincipledParams(jnp.array([1.0, 0.9, 0.2]), jnp.array(1.0), jnp.array(1.5))
"""Returns 1.05 of red light at the normal and 1.6 at the horizon; 0.22 to 0.36 of blue light."""

CONSERVING = scaled(PRINCIPLED.eval, lambda params: params)


def test_a_material_that_conserves_energy_has_no_scale():
    assert fit_energy_scale(LAMBERT.eval, LambertParams(jnp.full(3, 0.99)), isotropic=True) is None


def test_albedo_is_at_most_one_and_not_much_less():
    scale = fit_energy_scale(PRINCIPLED.eval, WHITE, isotropic=True)
    assert scale is not None
    for theta in (0.0, 0.3, 0.7, 1.1, 1.4, 1.55):
        wo = np.array([np.sin(theta), 0.0, np.cos(theta)])
        before = albedo_by_rings(PRINCIPLED.eval, WHITE, wo)
        after = albedo_by_rings(CONSERVING, (WHITE, scale), wo)
        assert before[0] > 1.03
        assert 0.985 < after[0] <= 1.0
        assert after[1] <= 1.0
    # blue is below one everywhere
    np.testing.assert_array_equal(np.asarray(scale.weights)[:, 2], 0.0)


def test_what_it_takes_is_reciprocal_and_never_light_that_is_not_there():
    scale = fit_energy_scale(PRINCIPLED.eval, WHITE, isotropic=True)
    assert scale is not None
    wi, wo = square_to_cosine(jax.random.uniform(jax.random.key(0), (2, 1000, 2)))
    there, back = (CONSERVING((WHITE, scale), Query(*pair)) for pair in ((wi, wo), (wo, wi)))
    np.testing.assert_allclose(there, back, rtol=2e-5)
    t = jnp.linspace(0.0, 1.0, 500)
    assert float(jnp.min(log2_loss(scale, view_at(t, 0.0 * t)))) > -1e-5


def test_the_spline_has_no_kink_and_its_slope_ends_at_the_horizon():
    weights = np.random.default_rng(1).normal(size=(KNOTS + 2, 3))
    knots = np.arange(1, KNOTS) / KNOTS
    with jax.enable_x64(True):
        slope = jax.vmap(jax.jacfwd(lambda t: scale_terms(t) @ jnp.asarray(weights)))
        before, after = (slope(jnp.asarray(knots + side)) for side in (-1e-9, 1e-9))
        np.testing.assert_allclose(before, after, atol=1e-6)
    scale = EnergyScale(jnp.asarray(weights, jnp.float32))
    for z in (0.0, 1e-30, 1e-8, 1.0):
        w = jnp.array([np.sqrt(1.0 - z * z), 0.0, z])
        assert np.isfinite(jax.jacfwd(lambda w: log2_loss(scale, w))(w)).all()
    assert float(grazing(jnp.array([0.0, 0.0, 1.0]))) == 0.0
