"""A shading normal against Mitsuba's `normalmap`, against frames made another way, and at its neutral value."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import jax.numpy as jnp
import numpy as np

from experiments.check_brdfs_against_mitsuba import draw_queries
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.brdf.microfacet import SEPARABLE_MICROFACET, MicrofacetParams
from jaxbrdf.brdf.normal_mapped import NormalMappedParams, normal_mapped, reciprocal_normal_mapped
from jaxbrdf.core.fresnel import Conductor
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.types import Material, Query
from tests.brdf import lobes
from tests.brdf.mitsuba_bsdfs import one_by_one

NORMAL = np.array([0.48, -0.36, 0.8])
ALBEDO = (0.7, 0.3, 0.05)
GREY = LambertParams(jnp.array(ALBEDO))
FACETS = MicrofacetParams(
    Ggx(Isotropic(jnp.array(0.3))), Conductor(jnp.array([0.2, 0.4, 1.3]), jnp.array([3.2, 2.5, 1.9]))
)


def about(normal: np.ndarray, base: Any) -> NormalMappedParams:
    return NormalMappedParams(jnp.asarray(normal, jnp.float32), base)


def mapped_in_mitsuba(mi: ModuleType, nested: dict[str, Any]) -> dict[str, Any]:
    """Mitsuba's `normalmap` of one texel that holds (n + 1) / 2."""
    texel = mi.Bitmap(((NORMAL + 1.0) / 2.0).astype(np.float32).reshape(1, 1, 3))
    texture = {"type": "bitmap", "bitmap": texel, "raw": True}
    # as normal mapping is elsewhere, without its softened terminator and its turned normals
    plain = {"use_shadowing_function": False, "flip_invalid_normals": False}
    return {"type": "normalmap", "normalmap": texture, **plain, "bsdf": nested}


def test_the_flat_normal_is_the_base():
    query = lobes.pairs(2000, 0)
    up = np.array([0.0, 0.0, 1.0])
    want = np.asarray(lobes.EVAL(SEPARABLE_MICROFACET, FACETS, query))
    for make in (normal_mapped, reciprocal_normal_mapped):
        np.testing.assert_allclose(lobes.EVAL(make(SEPARABLE_MICROFACET), about(up, FACETS), query), want, rtol=1e-6)


def test_it_is_what_mitsuba_shades(mitsuba_rgb: ModuleType):
    query = draw_queries(300, 2)
    eta, k = (np.asarray(value).tolist() for value in FACETS.fresnel)
    conductor = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.3}
    conductor |= {"eta": {"type": "rgb", "value": eta}, "k": {"type": "rgb", "value": k}}
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(ALBEDO)}}
    for base, params, nested in ((LAMBERT, GREY, diffuse), (SEPARABLE_MICROFACET, FACETS, conductor)):
        theirs = one_by_one(mitsuba_rgb, mapped_in_mitsuba(mitsuba_rgb, nested), query)
        mine = np.asarray(lobes.EVAL(normal_mapped(base), about(NORMAL, params), query))
        lit = theirs.value.max(axis=-1) > 0
        assert 0.3 < lit.mean() < 1.0
        np.testing.assert_allclose(mine[lit], theirs.value[lit], rtol=2e-4)
        assert np.abs(mine[~lit]).max() == 0.0


def test_the_reciprocal_part_is_the_mean_of_both_ways():
    query = lobes.pairs(2000, 1)
    whole = Material("", normal_mapped(SEPARABLE_MICROFACET), about(NORMAL, FACETS), False)
    want = lobes.EVAL(symmetrised(whole).brdf, whole.params, query)
    found = lobes.EVAL(reciprocal_normal_mapped(SEPARABLE_MICROFACET), whole.params, query)
    np.testing.assert_allclose(found, want, rtol=1e-5)


def test_a_lit_plate_keeps_its_light():
    """The light that a Lambert body sends to a viewer is its albedo times what its own horizon leaves of the sky."""
    wi = np.random.default_rng(0).normal(size=(200_000, 3))
    wi /= np.linalg.norm(wi, axis=-1, keepdims=True)
    wi[:, 2] = np.abs(wi[:, 2])
    query = Query(jnp.asarray(wi, jnp.float32), jnp.broadcast_to(jnp.array([0.0, 0.0, 1.0]), wi.shape))
    found = lobes.EVAL(normal_mapped(LAMBERT), about(NORMAL, GREY), query) * query.wi[:, 2:]
    # of the cosine-weighted hemisphere about n a share (1 + n_z) / 2 is above the surface
    want = np.array(ALBEDO) * (1.0 + NORMAL[2]) / 2.0
    np.testing.assert_allclose(np.mean(found, axis=0) * 2.0 * np.pi, want, rtol=5e-3)
