"""The tripleplane baseline over a surface and its scales: angular textures and a latent side by side into one decoder.

    ln f = MLP(z_h, z_d, z),   z_h = T(H, wh),   z_d = T(D, wd),   z = T(S, uv, J)

After Xu et al. (2024) as Timonen et al. run it (Eq. 5; section 5.2, baseline 3): directions are seen in the surface's
own frame and textures are not warped. The azimuth of wd wraps at pi: reciprocal by construction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.models import half_difference, mlp, spatial
from jaxbrdf.models.half_difference import TextureSizes, init_textures
from jaxbrdf.models.spatial import LatentTexture, SpatialCoordinates
from jaxbrdf.texture import angular
from jaxbrdf.texture.pyramid import Pyramid
from jaxbrdf.types import Model, Query

PAPER_VECTORS = TextureSizes(isotropic=False, channels=8)


@dataclass(frozen=True)
class SpatialTripleplaneConfig:
    """Sizes; the defaults are Timonen et al.'s (table 5, as deduced in docs/architecture.md).

    Attributes:
        latents: of S.
        textures: of H and D.
        hidden: widths of the hidden layers.
    """

    latents: LatentTexture = spatial.PAPER_LATENTS
    textures: TextureSizes = PAPER_VECTORS
    hidden: tuple[int, ...] = (16, 16, 16)


class SpatialTripleplaneParams(NamedTuple):
    """The pyramid of latents, angular textures `(channels, n_r, n_phi)` and the decoder."""

    s: Pyramid
    h: jax.Array
    d: jax.Array
    mlp: mlp.Mlp


def spatial_tripleplane(config: SpatialTripleplaneConfig) -> Model:
    """The tripleplane model over a surface at the sizes of `config`."""

    def init(key: jax.Array) -> SpatialTripleplaneParams:
        key_latents, key_textures, key_mlp = jax.random.split(key, 3)
        inputs = 2 * config.textures.channels + config.latents.channels
        return SpatialTripleplaneParams(
            spatial.init_latents(key_latents, config.latents),
            *init_textures(key_textures, config.textures),
            mlp.init(key_mlp, (inputs, *config.hidden, 3)),
        )

    polar = half_difference.encode(config.textures.isotropic)

    def decode(params: SpatialTripleplaneParams, coordinates: SpatialCoordinates) -> jax.Array:
        z = spatial.latents_at(params.s, coordinates, probes=config.latents.probes)
        at = polar(Query(coordinates.wi.T, coordinates.wo.T))
        z_h = angular.fetch(angular.close_centre(params.h), at.h)
        z_d = angular.fetch(angular.close_centre(params.d), at.d)
        return mlp.apply(params.mlp, jnp.concatenate([z_h, z_d, z]))

    return spatial.spatial_model(init, decode)
