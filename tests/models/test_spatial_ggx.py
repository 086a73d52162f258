"""GGX parameters as a pyramid: valid whatever is stored, and the reflectance that they stand for."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import logit

from jaxbrdf.brdf.metallic_roughness import MetallicRoughnessParams
from jaxbrdf.core.ranges import check_ranges
from jaxbrdf.core.roughness import LEAST_FILTERED
from jaxbrdf.models import ggx_mip
from jaxbrdf.models.ggx_mip import GgxMipConfig, GgxMipParams
from jaxbrdf.models.spatial import LatentTexture
from jaxbrdf.surface.textured import pack, reciprocal_textured
from jaxbrdf.texture.pyramid import Layout, Pyramid, build_pyramid
from jaxbrdf.types import Query
from tests.models.surfaces import queries, small

LAYOUT = Layout(8, 8)
NORMAL = np.array([0.2, -0.3, 0.0])
NORMAL[2] = np.sqrt(1 - NORMAL @ NORMAL)


def constant(specular: np.ndarray, diffuse: np.ndarray, a: float, b: float, c: float) -> GgxMipParams:
    """The raw numbers of a material, about `NORMAL`, in every texel: the maps of ggx_mip's docstring inverted."""
    left = np.sqrt(min((1 - a) * (1 - b), (a - LEAST_FILTERED) * (b - LEAST_FILTERED)))
    shares = [(alpha - LEAST_FILTERED) / (1 - LEAST_FILTERED) for alpha in (a, b)]
    numbers = [
        *(logit(specular) - ggx_mip.FIRST_SPECULAR),
        *logit(diffuse),
        *NORMAL[:2],
        np.log(np.expm1(NORMAL[2])) - ggx_mip.FIRST_HEIGHT,
        *(logit(shares) - ggx_mip.FIRST_ROUGHNESS),
        np.arctanh(c / left),
    ]
    return GgxMipParams(Pyramid(LAYOUT, jnp.asarray(np.tile(numbers, (LAYOUT.texels, 1)), jnp.float32)))


def steep(query: Query) -> Query:
    """Pairs away from both horizons: there the two kinds of masking of facets of alpha 0.01 differ by 1e-7 at most."""
    w = np.asarray([query.wi, query.wo])
    kept = np.flatnonzero(((w[..., 2] > 0.3) & (w @ NORMAL > 0.3)).all(axis=0))
    return jax.tree.map(lambda part: part[kept], query)


def test_a_smooth_metal_is_that_of_constant_maps():
    """Whose masking is separable, which for so smooth facets is the same."""
    colour, roughness = np.array([0.9, 0.6, 0.3]), 0.1
    maps = MetallicRoughnessParams(*(jnp.asarray(m, jnp.float32) for m in (colour, 1.0, roughness)))
    spread = jax.tree.map(lambda m: jnp.broadcast_to(m, (8, 8, *m.shape)), maps)
    texels = build_pyramid(LAYOUT, pack(spread, jnp.broadcast_to(jnp.asarray(NORMAL, jnp.float32), (8, 8, 3))))
    query = steep(queries(0, 3000))
    want = jax.jit(reciprocal_textured(LAYOUT).eval)(texels, query._replace(footprint=None))
    params = constant(colour, np.full(3, 1e-12), roughness**2, roughness**2, 0.0)
    found = jax.jit(small("ggx-mip").eval)(params, query)
    assert len(found) > 300
    np.testing.assert_allclose(found, want, rtol=3e-5, atol=1e-9)


@pytest.mark.parametrize("entries", [(0.3, 0.3, 0.0), (0.5, 0.2, 0.15), (0.1, 0.6, -0.05)])
def test_it_is_walters_formula_in_float64(entries: tuple[float, float, float]):
    specular, diffuse = np.array([0.04, 0.2, 0.8]), np.array([0.6, 0.3, 0.1])
    query = queries(1, 400)
    found = np.asarray(jax.jit(small("ggx-mip").eval)(constant(specular, diffuse, *entries), query))
    want = slow(query, specular, diffuse, *entries)
    np.testing.assert_allclose(found, want, rtol=2e-4, atol=1e-6)
    assert (want > 0).mean() > 0.5


def slow(query: Query, specular: np.ndarray, diffuse: np.ndarray, a: float, b: float, c: float) -> np.ndarray:
    """f in the frame of the normal by Smith's Lambda, and both ways of normal mapping."""
    matrix = np.array([[a, c], [c, b]])
    axis = np.cross([0, 0, 1], NORMAL)
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.arccos(NORMAL[2]))
    out = []
    for wi, wo in zip(np.asarray(query.wi, np.float64), np.asarray(query.wo, np.float64), strict=True):
        i, o = turn.inv().apply(wi), turn.inv().apply(wo)
        if min(i[2], o[2]) <= 0:
            out.append(np.zeros(3))
            continue
        h = (i + o) / np.linalg.norm(i + o)
        slope = np.linalg.solve(matrix, h[:2] / h[2])
        density = 1 / (np.pi * np.linalg.det(matrix) * h[2] ** 4 * (1 + slope @ slope) ** 2)
        hidden = [(np.sqrt(1 + np.sum((matrix @ w[:2] / w[2]) ** 2)) - 1) / 2 for w in (i, o)]
        fresnel = specular + (1 - specular) * (1 - i @ h) ** 5
        f = diffuse / np.pi + density * fresnel / ((1 + sum(hidden)) * 4 * i[2] * o[2])
        out.append(f * 0.5 * (i[2] / wi[2] + o[2] / wo[2]))
    return np.array(out)


@pytest.mark.parametrize("deviation", [0.1, 10.0, 1e4])
def test_whatever_is_stored_is_valid(deviation: float):
    numbers = jnp.asarray(deviation * np.random.default_rng(2).normal(size=(12, 1000)), jnp.float32)
    shaded = ggx_mip.valid(numbers)
    check_ranges(shaded.base.body)
    check_ranges(shaded.base.lobe)
    normal = np.asarray(shaded.normal)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1.0, atol=1e-5)
    assert (normal[:, 2] >= 0).all()


def test_zeros_are_a_plain_dielectric():
    shaded = ggx_mip.valid(jnp.zeros((12, 1)))
    np.testing.assert_allclose(shaded.normal[0], [0, 0, 1], atol=1e-6)
    np.testing.assert_allclose(shaded.base.body.albedo, 0.5)
    np.testing.assert_allclose(shaded.base.lobe.fresnel.f0, 0.04, rtol=0.03)


def test_other_numbers_of_channels_are_refused():
    with pytest.raises(ValueError, match=r"latents\.channels is 12, not 8"):
        GgxMipConfig(LatentTexture(channels=8))
