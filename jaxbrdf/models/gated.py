"""The half/difference texture model of Timonen et al. for homogeneous materials (section 3 without its spatial part).

ln f(wh, wd) = MLP(z_h, z_d) with z_h = T(H, warp_h(wh)) and z_d = T(D, warp_d(wd)); both textures are read in polar
coordinates of the disk-projected vector, the azimuth of wd wrapped to [0, pi): the model is reciprocal by construction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.models import horizon, mlp, output, warp
from jaxbrdf.models.half_difference import PAPER_SIZES, HalfDifferencePolar, TextureSizes, encode, init_textures
from jaxbrdf.texture import angular
from jaxbrdf.types import Model, Query


@dataclass(frozen=True)
class GatedConfig:
    """Sizes; the defaults are the paper's (Timonen et al., table 3).

    Attributes:
        textures: sizes of H and D.
        hidden: widths of the hidden layers.
        h_exponents, d_exponents: where the exponents of Eq. 7 start; (1, 1) is the identity, () is no warp at all.
        horizon: whether the growth towards the horizon is a factor of its own (`jaxbrdf.models.horizon`); not in the
        paper.
    """

    textures: TextureSizes = PAPER_SIZES
    hidden: tuple[int, ...] = (12, 12)
    h_exponents: tuple[float, ...] = (1.0, 1.0)
    d_exponents: tuple[float, ...] = (1.0, 1.0)
    horizon: bool = False


class GatedParams(NamedTuple):
    """Textures `(channels, n_r, n_phi)`, their warps or None, the decoder, and the horizon's exponent `()` or None."""

    h: jax.Array
    d: jax.Array
    warp_h: warp.RadialWarp | None
    warp_d: warp.RadialWarp | None
    mlp: mlp.Mlp
    horizon: jax.Array | None


class GatedCoordinates(NamedTuple):
    """Disk coordinates of both vectors, and ln of the mean secant or None."""

    textures: HalfDifferencePolar
    log_secant: jax.Array | None


def gated(config: GatedConfig) -> Model:
    """The gated model at the sizes of `config`."""

    def init(key: jax.Array) -> GatedParams:
        key_textures, key_mlp = jax.random.split(key)
        warps = _init_warp(config.h_exponents), _init_warp(config.d_exponents)
        decoder = mlp.init(key_mlp, (2 * config.textures.channels, *config.hidden, 3))
        exponent = jnp.asarray(horizon.FIRST_EXPONENT) if config.horizon else None
        return GatedParams(*init_textures(key_textures, config.textures), *warps, decoder, exponent)

    encode_textures = encode(config.textures.isotropic)

    def encode_query(query: Query) -> GatedCoordinates:
        return GatedCoordinates(encode_textures(query), horizon.log_mean_secant(query) if config.horizon else None)

    return output.model(init, encode_query, decode)


def _init_warp(exponents: tuple[float, ...]) -> warp.RadialWarp | None:
    return warp.init(exponents) if exponents else None


def decode(params: GatedParams, coordinates: GatedCoordinates) -> jax.Array:
    """ln f, `(3, batch)`, at coordinates of shape `(batch,)`."""
    z_h = _fetch_warped(params.h, params.warp_h, coordinates.textures.h)
    z_d = _fetch_warped(params.d, params.warp_d, coordinates.textures.d)
    log_f = mlp.apply(params.mlp, jnp.concatenate([z_h, z_d]))
    if params.horizon is None or coordinates.log_secant is None:
        return log_f
    return log_f + params.horizon * coordinates.log_secant[None]


def _fetch_warped(texture: jax.Array, warp_params: warp.RadialWarp | None, at: angular.Polar) -> jax.Array:
    if warp_params is not None:
        at = at._replace(r=warp.apply(warp_params, at.r))
    return angular.fetch(angular.close_centre(texture), at)
