"""SGGX filtering: the normals under a footprint as those of one ellipsoid (Heitz et al. 2015).

Facets of GGX roughness alpha about n are the front half of an ellipsoid's surface, whose matrix is

    S = n n^T + alpha^2 (1 - n n^T),   D(w) = 1 / (pi sqrt(det S) (w^T S^-1 w)^2),   sigma(w) = sqrt(w^T S w)

with D the density of normals over the whole sphere and sigma the ellipsoid's projected area. The
mean of S under the footprint is filtered linearly, six numbers a texel, and is again such a matrix.

What the paper shades is a volume of flakes: F D(wh) / (4 sigma(wo)) is a phase function and no BRDF. But every S is, up
to its scale, the square of a microsurface's matrix (`jaxbrdf.core.microsurface`),

    S = S_zz M M^T,   M = [[A, -mu], [0, 1]],   mu = -S_xyz / S_zz,   A^2 = S_xy / S_zz - mu mu^T

(S_xyz the column (S_xz, S_yz), S_xy the block of x and y). So D / sigma(z) above the horizon is exactly the
distribution of GGX facets with the mean slope mu and the roughness A. These are shaded in the surface's frame, with
Smith's masking and shadowing: reciprocal and keeping energy, as the phase function's division by sigma(wo) alone is
not. Normals below the horizon, which the ellipsoid has and a surface has not, are left out.

Against slopes (`jaxbrdf.surface.leadr`), normals count by n_z^2, so that steep ones, whose slopes have no bound, weigh
little. A flat map that is the same everywhere is the material of its points, to rounding. Of a tilted one the
distribution is that of its points, and masking and the surface's cosine are as LEADR's. In float32 A^2 is uncertain by
a few 2^-24 |mu|^2; its eigenvalues are raised to the least valid ones. The body is Lambert's about (-mu, 1).
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.metallic_facets import METALLIC_FACETS, MetallicFacetsParams
from jaxbrdf.brdf.metallic_roughness import MetallicRoughnessParams
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.ranges import clamp
from jaxbrdf.core.roughness import ROUGHNESS, Tensor
from jaxbrdf.sampling.tilted_cosine import Tilt, tilted_normal
from jaxbrdf.surface.slopes import roughness_of, slopes_of
from jaxbrdf.surface.textured import filtered
from jaxbrdf.texture.pyramid import Layout
from jaxbrdf.types import Brdf

LEAST_SQUARED = ROUGHNESS.low**2
"""Of A^2's eigenvalues."""


def pack_sggx(params: MetallicRoughnessParams, normal: jax.Array) -> jax.Array:
    """Maps and unit normals as one image `(H, W, 10)`: base colour, metallic, S_xx, S_yy, S_xy, S_xz, S_yz, S_zz.

    Parameters outside their ranges are taken as the nearest valid ones, and normals as steep as `slopes_of` lets them.
    """
    params, slope = clamp(params), slopes_of(normal)
    normal = tilted_normal(Tilt(slope[..., 0], slope[..., 1]))
    x, y, z = (normal[..., i : i + 1] for i in range(3))
    alpha_squared = params.roughness[..., None] ** 4
    outer = (y * y + z * z, x * x + z * z, x * x + y * y)
    # n n^T + alpha^2 (1 - n n^T), whose diagonal is n_i^2 + alpha^2 times the other two squares
    diagonal = [own * own + alpha_squared * rest for own, rest in zip((x, y, z), outer, strict=True)]
    off = [(1.0 - alpha_squared) * product for product in (x * y, x * z, y * z)]
    maps = (params.base_color, params.metallic[..., None], *diagonal[:2], *off, diagonal[2])
    return jnp.concatenate([jnp.broadcast_to(m, (*normal.shape[:2], m.shape[-1])) for m in maps], axis=-1)


def sggx(layout: Layout, *, probes: int = 16) -> Brdf:
    """The material under a footprint; its parameters are the pyramid of `pack_sggx`' image, `(texels, 10)`.

    Args:
        layout: of the pyramid.
        probes: the largest number of lookups.
    """
    return filtered(METALLIC_FACETS, layout, _params, probes=probes)


def _params(values: jax.Array) -> MetallicFacetsParams:
    return MetallicFacetsParams(values[..., :3], values[..., 3], facets_of(values[..., 4:]))


def facets_of(matrix: jax.Array) -> Ggx:
    """The facets of S, given as S_xx, S_yy, S_xy, S_xz, S_yz, S_zz, `(..., 6)`."""
    ratio = matrix[..., :5] / matrix[..., 5:]
    x, y = -ratio[..., 3], -ratio[..., 4]
    a, b, c = ratio[..., 0] - x * x, ratio[..., 1] - y * y, ratio[..., 2] - x * y
    beyond = Tensor(0.5 * (a - LEAST_SQUARED), 0.5 * (b - LEAST_SQUARED), 0.5 * c)
    roughness = roughness_of(beyond, jnp.full_like(x, LEAST_SQUARED))
    return Ggx(roughness, jnp.stack([x, y], axis=-1))
