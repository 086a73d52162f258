"""Lambert, and a diffuse body under a dielectric surface: Mitsuba, energy, samplers."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
import pytest

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, ggx
from jaxbrdf.brdf.substrate import SUBSTRATE, SubstrateParams
from jaxbrdf.checks.chi_square import chi_square
from jaxbrdf.checks.finite import find_faults
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Dielectric
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Query

pytestmark = pytest.mark.usefixtures("mitsuba_rgb")

ALBEDO = (0.8, 0.4, 0.1)
LOBES = {
    "lambert": (LAMBERT, LambertParams(jnp.array(ALBEDO))),
    "substrate": (SUBSTRATE, SubstrateParams(jnp.array(ALBEDO), jnp.array(1.5))),
}


def cosine_pairs(count: int) -> Query:
    u = jax.random.uniform(jax.random.key(0), (2, count, 2))
    return Query(square_to_cosine(u[0]), square_to_cosine(u[1]))


@pytest.mark.parametrize(("name", "plugin"), [("lambert", "diffuse"), ("substrate", "plastic")])
def test_values_match_mitsuba(name: str, plugin: str):
    colour = {"type": "rgb", "value": list(ALBEDO)}
    own = {"reflectance": colour} if plugin == "diffuse" else {"diffuse_reflectance": colour, "nonlinear": True}
    bsdf = mi.load_dict({"type": plugin} | own | ({} if plugin == "diffuse" else {"int_ior": 1.5, "ext_ior": 1.0}))
    query, want = cosine_pairs(200), []
    for wi, wo in zip(np.asarray(query.wi).tolist(), np.asarray(query.wo).tolist(), strict=True):
        interaction = mi.SurfaceInteraction3f()
        interaction.wi = wo
        want.append(np.array(bsdf.eval(mi.BSDFContext(), interaction, wi)) / wi[2])
    # Mitsuba fits the internal diffuse reflectance by a polynomial
    np.testing.assert_allclose(
        LOBES[name][0].eval(LOBES[name][1], query), want, rtol=1e-5 if name == "lambert" else 2e-3
    )


@pytest.mark.parametrize("name", LOBES)
def test_common_checks(name: str):
    brdf, params = LOBES[name]
    assert find_faults(brdf, params) == []
    assert float(jnp.max(asymmetry(brdf, params, cosine_pairs(2000)))) < 1e-6
    wo = spherical(jnp.array([0.0, 1.0, 1.57]), jnp.zeros(3))
    mismatch = sampler_mismatch(brdf, params, wo, jax.random.uniform(jax.random.key(1), (3, 3)))
    assert float(jnp.max(jnp.stack(mismatch))) < 1e-5
    assert chi_square(jax.random.key(2), brdf, params, wo[1]).p_value > 1e-3


def test_lambert_returns_its_albedo():
    albedo = directional_albedo(jax.random.key(3), *LOBES["lambert"], spherical(jnp.array(1.2), jnp.array(0.0)))
    np.testing.assert_allclose(albedo.value, ALBEDO, rtol=1e-5)


@pytest.mark.parametrize("theta", [0.0, 0.8, 1.3, 1.5])
def test_a_white_body_under_a_smooth_surface_loses_nothing(theta: float):
    wo, eta = spherical(jnp.array(theta), jnp.array(0.0)), jnp.array(1.5)
    body = directional_albedo(jax.random.key(4), SUBSTRATE, SubstrateParams(jnp.ones(3), eta), wo)
    surface = ggx(jnp.array(1e-4), jnp.array(1e-4), Dielectric(eta))
    mirror = directional_albedo(jax.random.key(5), MICROFACET, surface, wo, samples=1000)
    np.testing.assert_allclose(body.value + mirror.value, 1.0, atol=2e-3)


def test_nothing_is_sampled_for_a_viewer_below():
    wo = jnp.array([[0.6, 0.0, -0.8], [1.0, 0.0, 0.0]])
    for brdf, params in LOBES.values():
        drawn = brdf.sample(params, Query(wo, wo), jnp.full((2, 3), 0.3))
        assert not np.any(drawn.weight)
        assert not np.any(drawn.pdf)
