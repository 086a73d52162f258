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

from typing import Annotated, NamedTuple

import jax

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.metallic_facets import METALLIC_FACETS, MetallicFacetsParams
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.ranges import SHARE, Range
from jaxbrdf.core.roughness import ROUGHNESS, Isotropic
from jaxbrdf.types import Brdf, Query, Sample


class MetallicRoughnessParams(NamedTuple):
    """base_color: of body and metal. metallic: share of metal. roughness: its square is the facets' alpha."""

    base_color: Annotated[jax.Array, SHARE]
    metallic: Annotated[jax.Array, SHARE]
    roughness: Annotated[jax.Array, Range(ROUGHNESS.low**0.5, 1.0)]


_SAMPLER = sampler_of(METALLIC_FACETS)


def _with_facets(params: MetallicRoughnessParams) -> MetallicFacetsParams:
    facets = Ggx(Isotropic(params.roughness * params.roughness))
    return MetallicFacetsParams(params.base_color, params.metallic, facets)


def _eval(params: MetallicRoughnessParams, query: Query) -> jax.Array:
    return METALLIC_FACETS.eval(_with_facets(params), query)


def _sample(params: MetallicRoughnessParams, query: Query, u: jax.Array) -> Sample:
    return _SAMPLER.sample(_with_facets(params), query, u)


def _pdf(params: MetallicRoughnessParams, query: Query) -> jax.Array:
    return _SAMPLER.pdf(_with_facets(params), query)


METALLIC_ROUGHNESS = within_ranges(Brdf(_eval, _sample, _pdf))
