"""The classical ways to prefilter a material of maps, by name: what learned ones are measured by."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.metallic_roughness import MetallicRoughnessParams
from jaxbrdf.data.pbr import PbrTextures
from jaxbrdf.surface.leadr import leadr
from jaxbrdf.surface.lean import lean
from jaxbrdf.surface.sggx import pack_sggx, sggx
from jaxbrdf.surface.slopes import pack_slopes
from jaxbrdf.surface.textured import mip_mapped, pack
from jaxbrdf.texture.pyramid import Layout, build_pyramid
from jaxbrdf.types import Brdf, Material


class Prefilter(NamedTuple):
    """One way to prefilter.

    Attributes:
        pack: `(maps, unit normals) -> image` `(H, W, channels)`, whose means are what is filtered.
        brdf: `layout -> Brdf`, which shades those means once; queries have uv and a footprint.
    """

    pack: Callable[[MetallicRoughnessParams, jax.Array], jax.Array]
    brdf: Callable[[Layout], Brdf]


PREFILTERS: dict[str, Prefilter] = {
    "mip": Prefilter(pack, mip_mapped),
    "lean": Prefilter(pack_slopes, lean),
    "leadr": Prefilter(pack_slopes, leadr),
    "sggx": Prefilter(pack_sggx, sggx),
}


def baseline_of(prefilter: str, name: str, textures: PbrTextures) -> tuple[Layout, Material]:
    """A texture set as one of `PREFILTERS` shades it, which repeats over the plane, and the layout of its pyramid.

    Args:
        prefilter: a name in `PREFILTERS`.
        name: of the material.
        textures: the maps.

    Raises:
        ValueError: if there is no such prefilter.
    """
    if prefilter not in PREFILTERS:
        raise ValueError(f"prefilter is one of {', '.join(PREFILTERS)}, not {prefilter!r}")
    chosen = PREFILTERS[prefilter]
    maps = MetallicRoughnessParams(*map(jnp.asarray, (textures.base_color, textures.metallic, textures.roughness)))
    layout = Layout(*textures.metallic.shape)
    texels = build_pyramid(layout, chosen.pack(maps, jnp.asarray(textures.normal)))
    return layout, Material(name, chosen.brdf(layout), texels, False)
