"""What the models over half/difference textures share: sizes and first values of H and D, and their coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import (
    Components,
    components,
    half_difference_components,
    sum_and_half_difference,
)
from jaxbrdf.texture import angular
from jaxbrdf.types import Query

FIRST_DEVIATION = 0.1
"""Standard deviation of the first texels: features start well inside the decoder's linear range."""


@dataclass(frozen=True)
class TextureSizes:
    """Texels of H and D; the defaults are Timonen et al.'s (table 3), less the azimuth that an isotropic H lacks.

    Attributes:
        isotropic: H is a row over the radius alone.
        h_radii, h_azimuths: texels of H.
        d_radii, d_azimuths: texels of D.
        channels: features of each texture.
    """

    isotropic: bool = True
    h_radii: int = 32
    h_azimuths: int = 32
    d_radii: int = 32
    d_azimuths: int = 32
    channels: int = 6


PAPER_SIZES = TextureSizes()


class HalfDifferencePolar(NamedTuple):
    """Disk coordinates of the half and the difference vector."""

    h: angular.Polar
    d: angular.Polar


def init_textures(key: jax.Array, sizes: TextureSizes, *, channels: int | None = None) -> tuple[jax.Array, jax.Array]:
    """H and D, `(channels, n_r, n_phi)`, with independent normal texels; by default of the sizes' channels."""
    key_h, key_d = jax.random.split(key)
    channels = channels or sizes.channels
    shape_h = (channels, sizes.h_radii, 1 if sizes.isotropic else sizes.h_azimuths)
    shape_d = (channels, sizes.d_radii, sizes.d_azimuths)
    return FIRST_DEVIATION * jax.random.normal(key_h, shape_h), FIRST_DEVIATION * jax.random.normal(key_d, shape_d)


def encode(isotropic: bool) -> Callable[[Query], HalfDifferencePolar]:
    """Disk coordinates of wh, with period 2 pi or no azimuth, and of wd, wrapped to [0, pi): hence reciprocity."""

    def encode_query(query: Query) -> HalfDifferencePolar:
        pair = sum_and_half_difference(components(query.wi), components(query.wo))
        return on_disks(*half_difference_components(*pair), isotropic=isotropic)

    return encode_query


def on_disks(wh: Components, wd: Components, *, isotropic: bool) -> HalfDifferencePolar:
    """`encode` of half and difference vectors."""
    h = angular.polar_of(wh[0], wh[1], None if isotropic else 2 * jnp.pi)
    return HalfDifferencePolar(h, angular.polar_of(wd[0], wd[1], jnp.pi))
