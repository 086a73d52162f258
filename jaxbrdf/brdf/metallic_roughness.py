"""The metallic-roughness material of glTF 2.0, which most texture sets are made for.

    f = (1 - metallic) [(1 - Fd) base / pi + Fd S] + metallic Fm S,   S = D G2 / (4 cos_i cos_o)

(glTF 2.0 specification, appendix B.2 and B.3) with GGX facets of alpha = roughness^2, masking and shadowing independent
of each other, and Schlick's curves Fd from 0.04 and Fm from the base colour, at cos_d. Both curves are linear in their
start, so S is weighted by the one from 0.04 + metallic (base - 0.04). The appendix also suggests a shorter form, where
that coloured curve dims the body as well, in place of Fd; the two are the same at metallic 0 and 1.

Reciprocal. A metal returns less than it gets; a smooth white body returns 1.02 of it at 1 radian from the normal and
1.8 at 1.56, since Fd at cos_d is small for most of the light that a grazing viewer sees.

Parameters: base_color `(3,)` or `(..., 3)`; metallic, roughness `()` or `(...)`: one value each, or a texture's for
every query. Light is drawn from the cosine or from the visible facets, in proportion to what body and facets reflect at
the viewer's angle.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.directions import above_horizon, cos_theta
from jaxbrdf.core.fresnel import schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.numerics import match_rank, safe_norm, safe_normalize
from jaxbrdf.core.ranges import SHARE, Range
from jaxbrdf.core.roughness import ROUGHNESS, Isotropic
from jaxbrdf.core.smith import lift, separable_visibility
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.sampling.proposal import COSINE, VISIBLE_NORMALS, Proposal
from jaxbrdf.types import Query

DIELECTRIC_F0 = 0.04
"""Of an index of 1.5."""


class MetallicRoughnessParams(NamedTuple):
    """base_color: of body and metal. metallic: share of metal. roughness: its square is the facets' alpha."""

    base_color: Annotated[jax.Array, SHARE]
    metallic: Annotated[jax.Array, SHARE]
    roughness: Annotated[jax.Array, Range(ROUGHNESS.low**0.5, 1.0)]


def _eval(params: MetallicRoughnessParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    both, facets = wi + wo, _facets(params)
    body, surface = _shares(params, jnp.minimum(0.5 * safe_norm(both), 1.0))
    lobe = facets.density(safe_normalize(both)) * separable_visibility(facets, wi, wo)
    f = body / jnp.pi + surface * lobe[..., None]
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _shares(params: MetallicRoughnessParams, cos: jax.Array) -> tuple[jax.Array, jax.Array]:
    """What is left for the body, times its colour, and what the facets reflect, at their cosine: each `(..., 3)`."""
    rank = cos.ndim + 1
    base, metallic = match_rank(params.base_color, rank), match_rank(params.metallic[..., None], rank)
    taken = schlick(cos[..., None], jnp.asarray(DIELECTRIC_F0, cos.dtype))
    return (1.0 - metallic) * (1.0 - taken) * base, schlick(cos[..., None], _f0(base, metallic))


def _f0(base: jax.Array, metallic: jax.Array) -> jax.Array:
    return DIELECTRIC_F0 * (1.0 - metallic) + metallic * base


def _facets(params: MetallicRoughnessParams) -> Ggx:
    return Ggx(Isotropic(params.roughness * params.roughness))


def _draw(params: MetallicRoughnessParams, wo: jax.Array, u: jax.Array) -> jax.Array:
    draws = [partial(COSINE.sample, None, wo), partial(VISIBLE_NORMALS.sample, _facets(params), wo)]
    return choose(_chances(params, wo), draws, u)


def _density(params: MetallicRoughnessParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    densities = [COSINE.pdf(None, wi, wo), VISIBLE_NORMALS.pdf(_facets(params), wi, wo)]
    return blend(_chances(params, wo), densities)


def _chances(params: MetallicRoughnessParams, wo: jax.Array) -> jax.Array:
    """Of body and facets, `(..., 2)`: their albedo as a smooth surface has it.

    Facets are drawn as no darker than a dielectric's: a black metal too reflects at grazing angles.
    """
    cos = jnp.clip(cos_theta(wo), 0.0, 1.0)
    body, surface = (jnp.mean(share, axis=-1) for share in _shares(params, cos))
    return jnp.stack([body, jnp.maximum(surface, DIELECTRIC_F0)], axis=-1)


_PROPOSAL = Proposal(_draw, _density)
METALLIC_ROUGHNESS = within_ranges(sampled_by(_PROPOSAL, _eval, lambda params: Proposed(params, params)))
