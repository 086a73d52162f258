"""Where the fit of a spatially varying model starts: at noise, or at what the surface's own maps say."""

from __future__ import annotations

import jax

from jaxbrdf.brdf.metallic_facets import DIELECTRIC_F0
from jaxbrdf.models.ggx_mip import GgxMipParams, raw_numbers
from jaxbrdf.models.guided import guided
from jaxbrdf.surface.features import features_of
from jaxbrdf.surface.slopes import moments_of, pack_slopes, roughness_of
from jaxbrdf.surface.textured import unpack
from jaxbrdf.texture.pyramid import Pyramid, build_pyramid, level
from jaxbrdf.types import Params


def params_from_maps(params: Params, maps: Pyramid) -> Params:
    """Parameters of any spatial model over a surface of the same layout, its latents guided by the maps.

    A mip map of GGX lobes starts at LEAN mapping of every texel, other models as `jaxbrdf.models.guided` has it.

    Args:
        params: as the model's `init` gives them.
        maps: `surface.textured.surface_of`'s pyramid.

    Raises:
        ValueError: if the pyramids' layouts differ.
    """
    if params.s.layout != maps.layout:
        raise ValueError(f"latents are laid out as {params.s.layout}, the maps as {maps.layout}")
    if isinstance(params, GgxMipParams):
        return GgxMipParams(Pyramid(maps.layout, _lean_numbers(maps)))
    return guided(params, features_of(*maps))


def _lean_numbers(maps: Pyramid) -> jax.Array:
    """Raw numbers of the lobe that LEAN mapping gives each texel, `(texels, 12)`."""
    normal, params = unpack(level(*maps, 0))
    moments = moments_of(build_pyramid(maps.layout, pack_slopes(params, normal)))
    metallic = moments.metallic[:, None]
    specular = DIELECTRIC_F0 + (moments.base_color - DIELECTRIC_F0) * metallic
    return raw_numbers(
        specular,
        moments.base_color * (1.0 - metallic),
        -moments.slope,
        roughness_of(moments.covariance, moments.alpha_squared),
    )
