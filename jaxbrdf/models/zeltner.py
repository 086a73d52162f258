"""The decoder of Zeltner et al. (section 4): directions as seen in learned frames, and a latent, into one network.

    ln f = MLP(T_1 wi, T_1 wo, ..., T_N wi, T_N wo, z),   z = T(S, uv, J)

The frames are decoded from z by one linear layer (section 4.2). A direction may lie below the horizon of a frame, and
the network sees that. As Timonen et al. run it (section 5.2, baseline 2): latents are trained directly, without an
encoder, and the network gives the logarithm. Not reciprocal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.models import mlp, spatial
from jaxbrdf.models.shading_frame import NUMBERS, frame_of, seen
from jaxbrdf.models.spatial import LatentTexture, SpatialCoordinates
from jaxbrdf.texture.pyramid import Pyramid
from jaxbrdf.types import Model


@dataclass(frozen=True)
class ZeltnerConfig:
    """Sizes; the defaults are those of Timonen et al. (table 5, as deduced in docs/architecture.md).

    Attributes:
        latents: of S.
        frames: N, how many.
        hidden: widths of the hidden layers.

    Raises:
        ValueError: if there is no frame.
    """

    latents: LatentTexture = spatial.PAPER_LATENTS
    frames: int = 2
    hidden: tuple[int, ...] = (18, 18, 18)

    def __post_init__(self) -> None:
        if self.frames < 1:
            raise ValueError(f"frames is at least 1, not {self.frames}")


class ZeltnerParams(NamedTuple):
    """Latents and what is decoded from them.

    Attributes:
        s: the pyramid of latents.
        frame: `(channels, 6 N)`, without bias.
        mlp: the decoder.
    """

    s: Pyramid
    frame: jax.Array
    mlp: mlp.Mlp


def zeltner(config: ZeltnerConfig) -> Model:
    """The model at the sizes of `config`."""
    latent, frames = config.latents.channels, config.frames

    def init(key: jax.Array) -> ZeltnerParams:
        key_latents, key_mlp = jax.random.split(key)
        return ZeltnerParams(
            spatial.init_latents(key_latents, config.latents),
            jnp.zeros((latent, NUMBERS * frames)),
            mlp.init(key_mlp, (6 * frames + latent, *config.hidden, 3)),
        )

    def decode(params: ZeltnerParams, coordinates: SpatialCoordinates) -> jax.Array:
        z = spatial.latents_at(params.s, coordinates, probes=config.latents.probes)
        of_each = [frame_of(numbers) for numbers in jnp.split(params.frame.T @ z, frames)]
        directions = [seen(frame, w) for frame in of_each for w in (coordinates.wi, coordinates.wo)]
        return mlp.apply(params.mlp, jnp.concatenate([*directions, z]))

    return spatial.spatial_model(init, decode)
