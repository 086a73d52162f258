"""The tripleplane baseline for homogeneous materials: half and difference textures into one decoder, without warps.

ln f = MLP(T(H, wh), T(D, wd)); after Xu et al. (2024) as Timonen et al. run it in section 5.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.models import mlp, output
from jaxbrdf.models.half_difference import PAPER_SIZES, HalfDifferencePolar, TextureSizes, encode, init_textures
from jaxbrdf.texture import angular
from jaxbrdf.types import Model


@dataclass(frozen=True)
class TripleplaneConfig:
    """Sizes; the defaults are the paper's (Timonen et al., table 3).

    Attributes:
        textures: sizes of H and D.
        hidden: widths of the hidden layers.
    """

    textures: TextureSizes = PAPER_SIZES
    hidden: tuple[int, ...] = (14, 14)


class TripleplaneParams(NamedTuple):
    """Textures `(channels, n_r, n_phi)` and the decoder."""

    h: jax.Array
    d: jax.Array
    mlp: mlp.Mlp


def tripleplane(config: TripleplaneConfig) -> Model:
    """The tripleplane model at the sizes of `config`."""

    def init(key: jax.Array) -> TripleplaneParams:
        key_textures, key_mlp = jax.random.split(key)
        decoder = mlp.init(key_mlp, (2 * config.textures.channels, *config.hidden, 3))
        return TripleplaneParams(*init_textures(key_textures, config.textures), decoder)

    def decode(params: TripleplaneParams, coordinates: HalfDifferencePolar) -> jax.Array:
        z_h = angular.fetch(angular.close_centre(params.h), coordinates.h)
        z_d = angular.fetch(angular.close_centre(params.d), coordinates.d)
        return mlp.apply(params.mlp, jnp.concatenate([z_h, z_d]))

    return output.model(init, encode(config.textures.isotropic), decode)
