"""The glTF material with any microfacets: anisotropic ones, and such as lean to one side.

    f = (1 - metallic) [(1 - Fd) base cos_n / (pi cos_i) + Fd S] + metallic Fm S,   S = D G2 / (4 cos_i cos_o)

(glTF 2.0 specification, appendix B.2 and B.3) with masking and shadowing independent of each other, and Schlick's
curves Fd from 0.04 and Fm from the base colour, at cos_d. Both curves are linear in their start, so S is weighted by
the one from 0.04 + metallic (base - 0.04).

Facets with a mean slope are those of `jaxbrdf.core.microsurface`, in the surface's own frame. Their body is Lambert's
about the mean normal n: cos_n = max(wi . n, 0) is its cosine and cos_i the surface's, of which it is a shading
normal's quotient. Without a mean slope the two cosines are one.

The lobe is reciprocal, and returns no more than it gets: with masked areas a (`jaxbrdf.core.smith`) it is weighted,
for a visible normal, by area(wo) cos_i / (a_i a_o) <= 1. The body is reciprocal without a mean slope alone, and the two
together return more than they get as far as the glTF material does.

Light is drawn from the body's cosine or from the visible facets, in proportion to what body and facets reflect at the
viewer's angle.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import above_horizon, cos_theta, dot
from jaxbrdf.core.fresnel import schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.numerics import match_rank, safe_norm, safe_normalize
from jaxbrdf.core.ranges import SHARE
from jaxbrdf.core.smith import lift, separable_visibility
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.sampling.proposal import COSINE, VISIBLE_NORMALS, Proposal
from jaxbrdf.sampling.tilted_cosine import Tilt, square_to_tilted, tilted_density, tilted_normal
from jaxbrdf.types import Query

DIELECTRIC_F0 = 0.04
"""Of an index of 1.5."""

Facets = Ggx | Beckmann


class MetallicFacetsParams(NamedTuple):
    """base_color: of body and metal, `(..., 3)`. metallic: share of metal, `(...)`. facets: how they lie."""

    base_color: Annotated[jax.Array, SHARE]
    metallic: Annotated[jax.Array, SHARE]
    facets: Facets


def _eval(params: MetallicFacetsParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    both, facets = wi + wo, params.facets
    body, surface = _shares(params, jnp.minimum(0.5 * safe_norm(both), 1.0))
    lobe = facets.density(safe_normalize(both)) * separable_visibility(facets, wi, wo)
    f = body * _lambert(facets, wi) + surface * lobe[..., None]
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _lambert(facets: Facets, wi: jax.Array) -> jax.Array:
    """cos_n / (pi cos_i), `(..., 1)`."""
    if facets.slope is None:
        return jnp.full_like(wi[..., :1], 1.0 / jnp.pi)
    normal = match_rank(tilted_normal(_tilt(facets.slope)), wi.ndim)
    return (jnp.maximum(dot(wi, normal), 0.0) / (jnp.pi * wi[..., 2]))[..., None]


def _tilt(slope: jax.Array) -> Tilt:
    return Tilt(slope[..., 0], slope[..., 1])


def _shares(params: MetallicFacetsParams, cos: jax.Array) -> tuple[jax.Array, jax.Array]:
    """What is left for the body, times its colour, and what the facets reflect, at their cosine: each `(..., 3)`."""
    rank = cos.ndim + 1
    base, metallic = match_rank(params.base_color, rank), match_rank(params.metallic[..., None], rank)
    left = (1.0 - DIELECTRIC_F0) * _below_grazing(cos)[..., None]
    return (1.0 - metallic) * left * base, schlick(cos[..., None], _f0(base, metallic))


def _below_grazing(cos: jax.Array) -> jax.Array:
    """1 - (1 - cos)^5 as a sum that does not cancel: a leaning body divides it by a grazing cosine."""
    q = 1.0 - cos
    return cos * (1.0 + q * (1.0 + q * (1.0 + q * (1.0 + q))))


def _f0(base: jax.Array, metallic: jax.Array) -> jax.Array:
    return DIELECTRIC_F0 * (1.0 - metallic) + metallic * base


def _sample_body(facets: Facets, wo: jax.Array, u: jax.Array) -> jax.Array:
    if facets.slope is None:
        return COSINE.sample(None, wo, u)
    return square_to_tilted(_tilt(match_rank(facets.slope, u.ndim)), u[..., 1:])


def _body_pdf(facets: Facets, wi: jax.Array, wo: jax.Array) -> jax.Array:
    if facets.slope is None:
        return COSINE.pdf(None, wi, wo)
    density = tilted_density(_tilt(match_rank(facets.slope, wi.ndim)), wi)
    return jnp.where(above_horizon(wi, wo), density, 0.0)


def _draw(params: MetallicFacetsParams, wo: jax.Array, u: jax.Array) -> jax.Array:
    draws = [partial(_sample_body, params.facets, wo), partial(VISIBLE_NORMALS.sample, params.facets, wo)]
    return choose(_chances(params, wo), draws, u)


def _density(params: MetallicFacetsParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    densities = [_body_pdf(params.facets, wi, wo), VISIBLE_NORMALS.pdf(params.facets, wi, wo)]
    return blend(_chances(params, wo), densities)


def _chances(params: MetallicFacetsParams, wo: jax.Array) -> jax.Array:
    """Of body and facets, `(..., 2)`: their albedo as a smooth surface has it.

    Facets are drawn as no darker than a dielectric's: a black metal too reflects at grazing angles.
    """
    cos = jnp.clip(cos_theta(wo), 0.0, 1.0)
    body, surface = (jnp.mean(share, axis=-1) for share in _shares(params, cos))
    return jnp.stack([body, jnp.maximum(surface, DIELECTRIC_F0)], axis=-1)


METALLIC_FACETS = sampled_by(Proposal(_draw, _density), _eval, lambda params: Proposed(params, params))
"""Takes facets as they are, rougher ones than `jaxbrdf.core.roughness.ROUGHNESS` too: steep slopes have them."""
