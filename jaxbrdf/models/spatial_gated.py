"""The gated multi-scale model of Timonen et al. (section 3) over a surface and all its scales.

    ln f = MLP(z_h, z_d),   z_h = T(H, warp_h(wh)) z,   z_d = T(D, warp_d(wd)) z,   z = T(S, uv, J)

H and D hold matrices that the latent z multiplies (Eq. 6), the warps are decoded from z (Eq. 7), and wh, wd are those
of directions seen in one learned frame. The azimuth of wd wraps at pi: reciprocal by construction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import components, half_difference_components, sum_and_half_difference
from jaxbrdf.core.staging import staged_both_ways
from jaxbrdf.models import half_difference, mlp, spatial, warp
from jaxbrdf.models.half_difference import HalfDifferencePolar, TextureSizes, init_textures
from jaxbrdf.models.shading_frame import NUMBERS, frame_of, pair_above
from jaxbrdf.models.spatial import LatentTexture, SpatialCoordinates
from jaxbrdf.texture import angular
from jaxbrdf.texture.gated import fetch_gated
from jaxbrdf.texture.pyramid import Pyramid
from jaxbrdf.types import Model

FIRST_DIFFERENCE = 0.2
"""Of first matrices at different directions, over that of other textures' texels."""

PAPER_MATRICES = TextureSizes(isotropic=False, channels=5)


@dataclass(frozen=True)
class SpatialGatedConfig:
    """Sizes; the defaults are the paper's (Timonen et al., table 5, as deduced in docs/architecture.md).

    Attributes:
        latents: of S.
        textures: of H and D; `channels` are those of z_h and of z_d.
        hidden: widths of the hidden layers.
        gating: whether H and D hold matrices; otherwise z stands beside z_h and z_d as the decoder's input.
        frame: whether directions are seen in a learned frame.
        warp_terms: of each warp; zero for none.
    """

    latents: LatentTexture = spatial.PAPER_LATENTS
    textures: TextureSizes = PAPER_MATRICES
    hidden: tuple[int, ...] = (12, 12)
    gating: bool = True
    frame: bool = True
    warp_terms: int = 2


class LatentWarps(NamedTuple):
    """The linear layer from latents to both warps: weights `(channels, 4 k)` and biases `(4 k,)`."""

    weights: jax.Array
    biases: jax.Array


class SpatialGatedParams(NamedTuple):
    """Latents, angular textures `(numbers, n_r, n_phi)`, and what is decoded from latents; None where it is not there.

    Attributes:
        s: the pyramid of latents.
        h, d: of matrices `(D_h, D_s)` and `(D_d, D_s)`, row by row, or of vectors without gating.
        frame: `(channels, 6)`, without bias.
        warps: of H and D.
        mlp: the decoder.
    """

    s: Pyramid
    h: jax.Array
    d: jax.Array
    frame: jax.Array | None
    warps: LatentWarps | None
    mlp: mlp.Mlp


def spatial_gated(config: SpatialGatedConfig) -> Model:
    """The gated model at the sizes of `config`."""
    latent, own = config.latents.channels, config.textures.channels

    def init(key: jax.Array) -> SpatialGatedParams:
        key_latents, key_textures, key_mlp = jax.random.split(key, 3)
        if config.gating:
            h, d = _init_matrices(key_textures, config.textures, latent)
        else:
            h, d = init_textures(key_textures, config.textures)
        inputs = 2 * own + (0 if config.gating else latent)
        return SpatialGatedParams(
            spatial.init_latents(key_latents, config.latents),
            h,
            d,
            jnp.zeros((latent, NUMBERS)) if config.frame else None,
            _init_warps(latent, config.warp_terms),
            mlp.init(key_mlp, (inputs, *config.hidden, 3)),
        )

    def decode(params: SpatialGatedParams, coordinates: SpatialCoordinates) -> jax.Array:
        z = spatial.latents_at(params.s, coordinates, probes=config.latents.probes)
        at = _polar(params, z, coordinates)
        read = [(angular.close_centre(params.h), at.h), (angular.close_centre(params.d), at.d)]
        if config.gating:
            features = [fetch_gated(texture, place, z) for texture, place in read]
        else:
            features = [*(angular.fetch(texture, place) for texture, place in read), z]
        return mlp.apply(params.mlp, jnp.concatenate(features))

    return spatial.spatial_model(init, decode)


def _init_matrices(key: jax.Array, sizes: TextureSizes, latent: int) -> tuple[jax.Array, jax.Array]:
    """H and D of nearly the same random matrix everywhere, which keeps the size of z: the decoder first sees a linear
    map of the latents, not one of its own for every direction."""
    key_all, key_each = jax.random.split(key)
    numbers = sizes.channels * latent
    common = jax.random.normal(key_all, (2, numbers, 1, 1)) / latent**0.5
    h, d = init_textures(key_each, sizes, channels=numbers)
    return common[0] + FIRST_DIFFERENCE * h, common[1] + FIRST_DIFFERENCE * d


def _init_warps(channels: int, terms: int) -> LatentWarps | None:
    return LatentWarps(jnp.zeros((channels, 4 * terms)), jnp.zeros(4 * terms)) if terms else None


def _polar(params: SpatialGatedParams, z: jax.Array, coordinates: SpatialCoordinates) -> HalfDifferencePolar:
    """Where H and D are read."""
    both, across = sum_and_half_difference(components(coordinates.wi.T), components(coordinates.wo.T))
    if params.frame is not None:
        frame = staged_both_ways(frame_of(params.frame.T @ z))
        both, across = staged_both_ways(pair_above(frame, both, across))
    wh, wd = staged_both_ways(half_difference_components(both, across))
    at = half_difference.on_disks(wh, wd, isotropic=False)
    if params.warps is None:
        return at
    rows = params.warps.weights.T @ z + params.warps.biases[:, None]
    of_h, of_d = (warp.from_rows(part) for part in staged_both_ways(jnp.split(rows, 2)))
    return HalfDifferencePolar(at.h._replace(r=warp.apply(of_h, at.h.r)), at.d._replace(r=warp.apply(of_d, at.d.r)))
