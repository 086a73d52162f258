"""A material of texture maps as renderers shade it: metallic-roughness parameters and a shading normal at every point.

`textured` reads the maps bilinearly at their finest level, with no prefiltering: what lies under a footprint is the
mean of such points (`jaxbrdf.surface.prefilter`). `mip_mapped` shades the maps' own means under the footprint, as a
renderer does that knows no better: wrong where shading is not linear in them, and what prefiltering is measured by.

The frame of the surface has x along u and y up the picture, against v, as normal maps have it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.metallic_roughness import METALLIC_ROUGHNESS, MetallicRoughnessParams
from jaxbrdf.brdf.normal_mapped import NormalMappedParams, normal_mapped, reciprocal_normal_mapped
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.numerics import safe_normalize
from jaxbrdf.data.pbr import PbrTextures
from jaxbrdf.texture.lookup import anisotropic, bilinear
from jaxbrdf.texture.pyramid import Layout, build_pyramid
from jaxbrdf.types import Brdf, Material, Params, Query

SHADED = normal_mapped(METALLIC_ROUGHNESS)
RECIPROCAL = reciprocal_normal_mapped(METALLIC_ROUGHNESS)

CHANNELS = 8
"""Of `pack`'s image."""

Lookup = Callable[[jax.Array, Query], jax.Array]


def surface_of(name: str, textures: PbrTextures) -> tuple[Layout, Material]:
    """The material of a texture set, which repeats over the plane, and the layout of its pyramid."""
    maps = MetallicRoughnessParams(*map(jnp.asarray, (textures.base_color, textures.metallic, textures.roughness)))
    layout = Layout(*textures.metallic.shape)
    texels = build_pyramid(layout, pack(maps, jnp.asarray(textures.normal)))
    return layout, Material(name, textured(layout), texels, False)


def pack(params: MetallicRoughnessParams, normal: jax.Array) -> jax.Array:
    """Maps and unit normals as one image `(H, W, 8)`: base colour, metallic, roughness, normal."""
    maps = (params.base_color, params.metallic[..., None], params.roughness[..., None], normal)
    return jnp.concatenate([jnp.broadcast_to(m, (*normal.shape[:2], m.shape[-1])) for m in maps], axis=-1)


def unpack(values: jax.Array) -> NormalMappedParams:
    """Interpolated channels `(..., 8)` as a unit normal and parameters."""
    params = MetallicRoughnessParams(values[..., :3], values[..., 3], values[..., 4])
    return NormalMappedParams(safe_normalize(values[..., 5:]), params)


def textured(layout: Layout) -> Brdf:
    """The material at points; its parameters are the pyramid of `pack`'s image, `(texels, 8)`."""
    return _read(SHADED, partial(_at_point, layout), unpack)


def reciprocal_textured(layout: Layout) -> Brdf:
    """The reciprocal part of `textured`, which reciprocal models are fitted to."""
    return _read(RECIPROCAL, partial(_at_point, layout), unpack)


def mip_mapped(layout: Layout, *, probes: int = 16) -> Brdf:
    """`textured` shaded once for the maps' means under the footprint, by as many lookups as `probes`."""
    return filtered(SHADED, layout, unpack, probes=probes)


def reciprocal_mip_mapped(layout: Layout, *, probes: int = 16) -> Brdf:
    """The reciprocal part of `mip_mapped`, beside models that are fitted to `reciprocal_textured`."""
    return filtered(RECIPROCAL, layout, unpack, probes=probes)


def filtered(shaded: Brdf, layout: Layout, unpack: Callable[[jax.Array], Params], *, probes: int) -> Brdf:
    """`shaded` once for the means under the footprint, of a pyramid of any channels.

    Args:
        shaded: the reflectance.
        layout: of the pyramid, which is the result's parameters.
        unpack: the means `(..., channels)` as the parameters of `shaded`.
        probes: the largest number of lookups.
    """
    return _read(shaded, partial(_under_footprint, layout, probes), unpack)


def _at_point(layout: Layout, texels: jax.Array, query: Query) -> jax.Array:
    if query.uv is None or query.footprint is not None:
        raise ValueError("query must have uv and no footprint; jaxbrdf.surface.prefilter has the mean over one")
    return bilinear(layout, texels, query.uv)


def _under_footprint(layout: Layout, probes: int, texels: jax.Array, query: Query) -> jax.Array:
    if query.uv is None or query.footprint is None:
        raise ValueError("query must have uv and a footprint; `textured` is the material at points")
    return anisotropic(layout, texels, query.uv, query.footprint, probes=probes)


def _read(shaded: Brdf, lookup: Lookup, unpack: Callable[[jax.Array], Params]) -> Brdf:
    """`shaded` with its parameters looked up at each query."""

    def of_texels(function: Callable) -> Callable:
        return lambda texels, query, *u: function(unpack(lookup(texels, query)), query, *u)

    sampler = sampler_of(shaded)
    return Brdf(of_texels(shaded.eval), of_texels(sampler.sample), of_texels(sampler.pdf))
