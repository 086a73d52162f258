"""The coat: the base where there is none, closed forms, the furnace, and the position-free reference."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.layered import LayeredParams, diffuse_return, layered
from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams
from jaxbrdf.brdf.oren_nayar import OREN_NAYAR, OrenNayarParams
from jaxbrdf.brdf.position_free import StackParams, position_free
from jaxbrdf.brdf.rough_interface import InterfaceParams
from jaxbrdf.brdf.substrate import SUBSTRATE, SubstrateParams
from jaxbrdf.brdf.transmissivity import transmissivity
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Conductor, Dielectric, Schlick, dielectric
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.medium import Medium
from jaxbrdf.core.roughness import Axes, Isotropic
from jaxbrdf.types import Query
from tests.brdf.lobes import (
    EVAL,
    pairs,
    viewer,
)

COATED_METAL, COATED_CLAY = layered(MICROFACET), layered(OREN_NAYAR, diffuse=True)
TINT = jnp.array([0.1, 0.4, 1.0])


def gold(alpha: float) -> MicrofacetParams:
    index = Conductor(jnp.array([0.223, 0.428, 1.335]), jnp.array([3.204, 2.460, 1.872]))
    return MicrofacetParams(Ggx(Isotropic(jnp.array(alpha))), index)


def clay(albedo: tuple[float, float, float] = (0.8, 0.5, 0.2)) -> OrenNayarParams:
    return OrenNayarParams(jnp.array(albedo), jnp.array(0.0))


def coat(alpha: float, eta: float, base, absorption: jax.Array | None = None) -> LayeredParams:
    return LayeredParams(Ggx(Isotropic(jnp.array(alpha))), jnp.array(eta), base, absorption)


@pytest.mark.parametrize("alpha", [1e-4, 0.5])
def test_a_coat_of_index_one_is_not_there(alpha: float):
    query = pairs(2000, 0)
    for brdf, base, own in ((COATED_METAL, MICROFACET, gold(0.2)), (COATED_CLAY, OREN_NAYAR, clay())):
        want = np.asarray(EVAL(base, own, query))
        # compiled as one function with the coat, the base is rounded otherwise
        np.testing.assert_allclose(EVAL(brdf, coat(alpha, 1.0, own), query), want, rtol=1e-6)
        np.testing.assert_allclose(EVAL(brdf, coat(alpha, 1.0, own, jnp.zeros(3)), query), want, rtol=1e-6)
    u = jax.random.uniform(jax.random.key(1), query.wo.shape)
    bare = jax.jit(MICROFACET.sample)(gold(0.2), query, u)
    drawn = jax.jit(COATED_METAL.sample)(coat(alpha, 1.0, gold(0.2)), query, u)
    lit = (np.asarray(bare.wi)[:, 2] > 1e-3) & (np.asarray(query.wo)[:, 2] > 1e-3)
    np.testing.assert_allclose(drawn.wi[lit], bare.wi[lit], rtol=2e-6, atol=2e-6)


def test_a_smooth_coat_over_lambert_is_the_closed_form():
    query, albedo = pairs(2000, 2), (0.8, 0.5, 1.0)
    params = coat(1e-4, 1.5, clay(albedo))
    highlight = EVAL(MICROFACET, MicrofacetParams(params.coat, Dielectric(params.eta)), query)
    want = EVAL(SUBSTRATE, SubstrateParams(jnp.array(albedo), params.eta), query) + highlight
    # at grazing angles facets of 1e-4 are not a smooth interface
    kept = (np.asarray(query.wi)[:, 2] > 0.02) & (np.asarray(query.wo)[:, 2] > 0.02)
    np.testing.assert_allclose(EVAL(COATED_CLAY, params, query)[kept], want[kept], rtol=1e-4)


def test_a_smooth_coat_over_a_white_metal_passes_what_the_worse_side_lets_in():
    """T_i T_o / (1 - min(F_i, F_o)) = min(T_i, T_o), with T by Fresnel's equations."""
    query = pairs(2000, 3)
    off_mirror = np.linalg.norm((query.wi + query.wo)[:, :2], axis=-1) > 0.05
    kept = off_mirror & (np.asarray(query.wi)[:, 2] > 1e-2) & (np.asarray(query.wo)[:, 2] > 1e-2)
    query = Query(query.wi[kept], query.wo[kept])
    white = MicrofacetParams(Ggx(Isotropic(jnp.array(0.3))), Schlick(jnp.ones(3)))
    inside = [jnp.concatenate([w[:, :2], jnp.sqrt(1.25 + w[:, 2:] ** 2)], -1) / 1.5 for w in query[:2]]
    share = 1.0 - jnp.maximum(*(dielectric(w[:, 2], jnp.array(1.5)) for w in query[:2]))
    want = EVAL(MICROFACET, white, Query(*inside)) * share[:, None] / 2.25
    np.testing.assert_allclose(EVAL(COATED_METAL, coat(1e-4, 1.5, white), query), want, rtol=1e-3)


@pytest.mark.parametrize("facets", [Ggx, Beckmann])
@pytest.mark.parametrize("alpha", [0.1, 1.0])
def test_transmissivity_is_the_mean_over_visible_facets(facets: type, alpha: float):
    normals = facets(Axes(jnp.array(alpha), jnp.array(0.5 * alpha)))
    w = jnp.stack([viewer(theta) for theta in (0.0, 0.6, 1.1, 1.4, 1.55)])
    u = jax.random.uniform(jax.random.key(4), (40_000, 5, 2))
    wh = jax.jit(normals.sample_visible)(jnp.broadcast_to(w, (40_000, 5, 3)), u)
    cos = jnp.clip(jnp.sum(w[None] * wh, -1), 0.0, 1.0)
    want = 1.0 - jnp.mean(dielectric(cos, jnp.array(1.5)), axis=0)
    # 0.005, and four standard errors of the mean over draws that spread by 0.1
    np.testing.assert_allclose(transmissivity(normals, jnp.array(1.5), w), want, atol=0.007)


def test_what_comes_back_to_a_diffuse_base():
    """By a fine sum over the cosines inside, through the smooth interface and the medium."""
    cos = (np.arange(200_000) + 0.5) / 200_000
    inside = np.asarray(dielectric(jnp.asarray(cos, jnp.float32), jnp.array(1 / 1.5)), float)
    want = [np.mean(2 * cos * inside * np.exp(-2 * depth / cos)) for depth in np.asarray(TINT, float)]
    np.testing.assert_allclose(diffuse_return(coat(1e-4, 1.5, clay(), TINT)), want, rtol=2e-3)


MATERIALS = {
    "clear on gold": (COATED_METAL, coat(0.1, 1.5, gold(0.3))),
    "tinted on clay": (COATED_CLAY, coat(0.3, 1.5, clay(), TINT)),
}


@pytest.mark.parametrize(("alpha", "eta"), [(0.01, 1.5), (0.3, 1.3), (0.6, 2.5)])
def test_white_furnace(alpha: float, eta: float):
    white = MicrofacetParams(Ggx(Isotropic(jnp.array(0.01))), Schlick(jnp.ones(3)))
    for theta in (0.0, 0.8, 1.3):
        metal = directional_albedo(jax.random.key(5), COATED_METAL, coat(alpha, eta, white), viewer(theta))
        body = directional_albedo(jax.random.key(6), COATED_CLAY, coat(alpha, eta, clay((1, 1, 1))), viewer(theta))
        for albedo in (metal, body):
            assert np.all(albedo.value < 1.0 + 1e-3 + 4 * albedo.standard_error), (theta, albedo)
        if alpha == 0.01:
            assert np.all(body.value > 0.99)
            # the worse of both sides decides, which at grazing angles costs a lobe a tenth
            assert np.all(metal.value > (0.97 if theta < 1 else 0.88))


def test_isotropy():
    turn = jnp.array([[np.cos(0.9), np.sin(0.9), 0.0], [-np.sin(0.9), np.cos(0.9), 0.0], [0.0, 0.0, 1.0]], jnp.float32)
    query = pairs(2000, 7)
    near = (np.asarray(query.wi)[:, 2] > 1e-2) & (np.asarray(query.wo)[:, 2] > 1e-2)
    for brdf, params in MATERIALS.values():
        there = EVAL(brdf, params, query)[near]
        np.testing.assert_allclose(EVAL(brdf, params, Query(query.wi @ turn, query.wo @ turn))[near], there, rtol=2e-3)


def test_refuses_a_diffuse_base_of_unknown_albedo():
    with pytest.raises(ValueError, match="albedo"):
        layered(MICROFACET, diffuse=True)


REFERENCE = jax.jit(position_free(OREN_NAYAR).estimate, static_argnames="samples")
METAL_REFERENCE = jax.jit(position_free(MICROFACET).estimate, static_argnames="samples")


def test_stays_close_to_the_position_free_reference():
    """Under a smooth coat nothing is left out over a diffuse base, and over a metal what comes back at wide angles."""
    wo = spherical(jnp.array([0.2, 0.7, 0.9]), jnp.zeros(3))
    about, mirrored = jnp.array([2.0, 2.8, 2.0]), jnp.full(3, jnp.pi)
    for brdf, reference, base, azimuth, slack in (
        (COATED_CLAY, REFERENCE, clay(), about, 0.01),
        (COATED_METAL, METAL_REFERENCE, gold(0.2), mirrored, 0.08),
    ):
        query = Query(spherical(jnp.array([0.4, 0.5, 0.8]), azimuth), wo)
        stack = StackParams((InterfaceParams(Ggx(Isotropic(jnp.array(0.02))), jnp.array(1.5)),), (Medium(TINT),), base)
        want = reference(jax.random.key(8), stack, query, samples=8192)
        off = np.abs(EVAL(brdf, coat(0.02, 1.5, base, TINT), query) - want.value)
        assert np.all(off < slack * want.value + 4 * want.standard_error), off / want.value
