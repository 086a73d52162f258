"""LEAN mapping: the normals under a footprint as rougher facets about their mean (Olano and Baker 2010).

The means and the covariance of slopes (`jaxbrdf.surface.slopes`) give a mean normal n = (-mu, 1) / |(-mu, 1)| and
anisotropic facets about it, which are shaded once, as `jaxbrdf.brdf.normal_mapped` shades about a normal. It does not
know that a viewer sees more of the facets that lean to it, nor that they hide each other in the surface's frame, which
`jaxbrdf.surface.leadr` does.

The paper adds the points' own spread to the covariance in the surface's plane. Here the covariance is taken to the
plane of the mean normal first, where points have theirs: a slope of mu + d is seen from n as J d in first order, with
J = n_z (1 - n_xy n_xy^T / (1 + n_z)), and C as J C J^T. So a map that is the same everywhere is the material of its
points, to rounding. Without a mean slope the two are one.

What is not linear in slopes is not filtered rightly: the body is Lambert's about the mean normal, the facets' Fresnel
that of the mean colours, and of the distribution no more than two moments are kept.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax

from jaxbrdf.brdf.metallic_facets import METALLIC_FACETS, Facets, MetallicFacetsParams
from jaxbrdf.brdf.normal_mapped import NormalMappedParams, normal_mapped
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Tensor
from jaxbrdf.sampling.tilted_cosine import Tilt, tilted_normal
from jaxbrdf.surface.slopes import moments_of, roughness_of
from jaxbrdf.surface.textured import filtered
from jaxbrdf.texture.pyramid import Layout
from jaxbrdf.types import Brdf

SHADED = normal_mapped(METALLIC_FACETS)


def lean(layout: Layout, *, probes: int = 16, facets: Callable[[Tensor], Facets] = Ggx) -> Brdf:
    """The material under a footprint; its parameters are the pyramid of `pack_slopes`' image, `(texels, 10)`.

    Args:
        layout: of the pyramid.
        probes: the largest number of lookups.
        facets: of a roughness; `Ggx` are those of the points, `Beckmann` those that the moments are exact for.
    """
    return filtered(SHADED, layout, partial(_params, facets), probes=probes)


def _params(facets: Callable[[Tensor], Facets], values: jax.Array) -> NormalMappedParams:
    moments = moments_of(values)
    normal = tilted_normal(Tilt(moments.slope[..., 0], moments.slope[..., 1]))
    roughness = roughness_of(_seen_from(normal, moments.covariance), moments.alpha_squared)
    return NormalMappedParams(normal, MetallicFacetsParams(moments.base_color, moments.metallic, facets(roughness)))


def _seen_from(normal: jax.Array, covariance: Tensor) -> Tensor:
    """J C J^T."""
    x, y, z = normal[..., 0], normal[..., 1], normal[..., 2]
    a, b, c = covariance
    j_x, j_y, j_c = z * (1.0 - x * x / (1.0 + z)), z * (1.0 - y * y / (1.0 + z)), -z * x * y / (1.0 + z)
    # rows of J C, times J
    x_a, x_c, y_a, y_c = j_x * a + j_c * c, j_x * c + j_c * b, j_c * a + j_y * c, j_c * c + j_y * b
    return Tensor(x_a * j_x + x_c * j_c, y_a * j_c + y_c * j_y, x_a * j_c + x_c * j_y)
