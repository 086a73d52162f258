"""NeuMIP (Kuznetsov et al. 2021): a network over directions and a latent, read where a second network looks for it.

    ln f = MLP(z, wi_xy, wo_xy),   z = T(S, uv + h (wo_x, -wo_y) / max(wo_z, 1/16), J),   h = MLP_o(T(S_o, uv), wo_xy)

The offset module finds the height h, in units of uv, at which a ray to the viewer leaves a relief, by the latent of a
texture of one level; what is seen at height h is displaced along the ray. y is up the picture, against v. The decoder
sees directions projected to the disk. As Timonen et al. run it (section 5.2, baseline 1). Not reciprocal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.models import mlp, spatial
from jaxbrdf.models.spatial import LatentTexture, SpatialCoordinates
from jaxbrdf.texture.pyramid import Pyramid
from jaxbrdf.types import Model

LEAST_COSINE = 1.0 / 16.0
"""Of the viewer, as the offset divides by it. What a pixel sees is 1 / cos times as long as wide, and a lookup of 16
probes follows it to that ratio: beyond, it mixes more along the ray than a shift there could tell apart. It bounds the
offset, and its derivative by the height, to 16."""

PAPER_OFFSET_LATENTS = LatentTexture(channels=7, levels=1)


@dataclass(frozen=True)
class NeumipConfig:
    """Sizes; by default those of Timonen et al.'s table 5.

    Their networks are not given, but have 5.06 kB in all: 12-18-18-18-3 and 9-12-12-1, which are 975 + 289 numbers, are
    not the only ones that do.

    Attributes:
        latents: of S.
        hidden: widths of the decoder's hidden layers.
        offset_latents: of the texture that the height is decoded from.
        offset_hidden: widths of its hidden layers.
    """

    latents: LatentTexture = spatial.PAPER_LATENTS
    hidden: tuple[int, ...] = (18, 18, 18)
    offset_latents: LatentTexture = PAPER_OFFSET_LATENTS
    offset_hidden: tuple[int, ...] = (12, 12)


class NeumipParams(NamedTuple):
    """Latents and networks.

    Attributes:
        s: the pyramid of latents.
        offset: latents of the height.
        height: the network that gives it.
        mlp: the decoder.
    """

    s: Pyramid
    offset: Pyramid
    height: mlp.Mlp
    mlp: mlp.Mlp


def neumip(config: NeumipConfig) -> Model:
    """The model at the sizes of `config`; it starts without an offset."""

    def init(key: jax.Array) -> NeumipParams:
        key_latents, key_mlp, key_offset, key_height = jax.random.split(key, 4)
        return NeumipParams(
            spatial.init_latents(key_latents, config.latents),
            spatial.init_latents(key_offset, config.offset_latents),
            _flat(mlp.init(key_height, (config.offset_latents.channels + 2, *config.offset_hidden, 1))),
            mlp.init(key_mlp, (config.latents.channels + 4, *config.hidden, 3)),
        )

    def decode(params: NeumipParams, coordinates: SpatialCoordinates) -> jax.Array:
        wi, wo = coordinates.wi, coordinates.wo
        at_point = spatial.latents_at(params.offset, coordinates._replace(footprint=None), probes=1)
        height = mlp.apply(params.height, jnp.concatenate([at_point, wo[:2]]))
        moved = coordinates._replace(uv=coordinates.uv + height * _per_height(wo))
        z = spatial.latents_at(params.s, moved, probes=config.latents.probes)
        return mlp.apply(params.mlp, jnp.concatenate([z, wi[:2], wo[:2]]))

    return spatial.spatial_model(init, decode)


def _flat(height: mlp.Mlp) -> mlp.Mlp:
    """The network with an output of zero: only its last layer, whose gradient is not."""
    *hidden, last = height.weights
    return height._replace(weights=(*hidden, jnp.zeros_like(last)))


def _per_height(wo: jax.Array) -> jax.Array:
    """The offset in uv of what is seen at height one, `(2, batch)`."""
    return jnp.stack([wo[0], -wo[1]]) / jnp.maximum(wo[2:], LEAST_COSINE)
