"""The half/difference texture model of Timonen et al. for homogeneous materials (section 3 without its spatial part).

ln f(wh, wd) = MLP(z_h, z_d) with z_h = T(H, warp_h(wh)) and z_d = T(D, warp_d(wd)); both textures are read in polar
coordinates of the disk-projected vector, the azimuth of wd wrapped to [0, pi): the model is reciprocal by construction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.models import mlp, output, warp
from jaxbrdf.models.half_difference import PAPER_SIZES, HalfDifferencePolar, TextureSizes, encode, init_textures
from jaxbrdf.texture import angular
from jaxbrdf.types import Model


@dataclass(frozen=True)
class GatedConfig:
    """Sizes; the defaults are the paper's (Timonen et al., table 3).

    Attributes:
        textures: sizes of H and D.
        hidden: widths of the hidden layers.
        h_exponents, d_exponents: where the exponents of Eq. 7 start; (1, 1) is the identity.
    """

    textures: TextureSizes = PAPER_SIZES
    hidden: tuple[int, ...] = (12, 12)
    h_exponents: tuple[float, ...] = (1.0, 1.0)
    d_exponents: tuple[float, ...] = (1.0, 1.0)


class GatedParams(NamedTuple):
    """Textures `(channels, n_r, n_phi)`, their warps, and the decoder."""

    h: jax.Array
    d: jax.Array
    warp_h: warp.RadialWarp
    warp_d: warp.RadialWarp
    mlp: mlp.Mlp


def gated(config: GatedConfig) -> Model:
    """The gated model at the sizes of `config`."""

    def init(key: jax.Array) -> GatedParams:
        key_textures, key_mlp = jax.random.split(key)
        warps = warp.init(config.h_exponents), warp.init(config.d_exponents)
        decoder = mlp.init(key_mlp, (2 * config.textures.channels, *config.hidden, 3))
        return GatedParams(*init_textures(key_textures, config.textures), *warps, decoder)

    def decode(params: GatedParams, coordinates: HalfDifferencePolar) -> jax.Array:
        z_h = _fetch_warped(params.h, params.warp_h, coordinates.h)
        z_d = _fetch_warped(params.d, params.warp_d, coordinates.d)
        return mlp.apply(params.mlp, jnp.concatenate([z_h, z_d]))

    return output.model(init, encode(config.textures.isotropic), decode)


def _fetch_warped(texture: jax.Array, warp_params: warp.RadialWarp, at: angular.Polar) -> jax.Array:
    r = jax.lax.optimization_barrier(warp.apply(warp_params, at.r))
    return angular.fetch(angular.close_centre(texture), at._replace(r=r))
