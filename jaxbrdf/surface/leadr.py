"""LEADR mapping: the normals under a footprint as facets of the surface itself (Dupuy et al. 2013).

The moments are LEAN's (`jaxbrdf.surface.slopes`); what is made of them is a microsurface in the surface's own frame,
with the mean slope mu and the roughness A of A^2 = 2 C + E[alpha^2], the points' own spread added to the covariance
there, as in the paper. Facets that lean to the viewer count by the area that they show, and masking and shadowing are
Smith's for a mean slope. The lobe is reciprocal and keeps energy.

A flat map that is the same everywhere is the material of its points, to rounding. A tilted one is not: points are
shaded about their normal, which loses or makes light, and the microsurface does not.

The paper's masking and shadowing are correlated; here they are independent, as the points' are. Its body is an
integral over all facets, and here Lambert's about the mean normal, as for LEAN: not reciprocal where that leans.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax

from jaxbrdf.brdf.metallic_facets import METALLIC_FACETS, Facets, MetallicFacetsParams
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Tensor
from jaxbrdf.surface.slopes import moments_of, roughness_of
from jaxbrdf.surface.textured import filtered
from jaxbrdf.texture.pyramid import Layout
from jaxbrdf.types import Brdf


def leadr(layout: Layout, *, probes: int = 16, facets: Callable[[Tensor, jax.Array], Facets] = Ggx) -> Brdf:
    """The material under a footprint; its parameters are the pyramid of `pack_slopes`' image, `(texels, 10)`.

    Args:
        layout: of the pyramid.
        probes: the largest number of lookups.
        facets: of a roughness and a mean slope; `Ggx` are those of the points, `Beckmann` those of the paper.
    """
    return filtered(METALLIC_FACETS, layout, partial(_params, facets), probes=probes)


def _params(facets: Callable[[Tensor, jax.Array], Facets], values: jax.Array) -> MetallicFacetsParams:
    moments = moments_of(values)
    roughness = roughness_of(moments.covariance, moments.alpha_squared)
    return MetallicFacetsParams(moments.base_color, moments.metallic, facets(roughness, moments.slope))
