"""What the models over a surface share: a pyramid of latents, and their coordinates.

A spatial model knows where it is asked and under which footprint by its latents alone, z = T(S, uv, J): one texture
lookup, anisotropic, as a renderer's hardware does it (Timonen et al., section 3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.models.half_difference import FIRST_DEVIATION
from jaxbrdf.models.output import reflectance
from jaxbrdf.texture.lookup import anisotropic, bilinear
from jaxbrdf.texture.pyramid import Layout, Pyramid, Wrap
from jaxbrdf.types import Model, Params, Query


@dataclass(frozen=True)
class LatentTexture:
    """Size of a pyramid of latents; the defaults are Timonen et al.'s (section 5.2).

    Attributes:
        height, width: texels of its finest level.
        channels: numbers of a latent.
        wrap: what lies outside one period.
        probes: the most lookups along a footprint; one is isotropic filtering.
        levels: how many there are; None is all, down to one texel.
    """

    height: int = 1024
    width: int = 1024
    channels: int = 8
    wrap: Wrap = "repeat"
    probes: int = 16
    levels: int | None = None

    @property
    def layout(self) -> Layout:
        """Where its texels stand."""
        return Layout(self.height, self.width, self.wrap, self.levels)


PAPER_LATENTS = LatentTexture()


class SpatialCoordinates(NamedTuple):
    """Queries with the batch last.

    Attributes:
        wi, wo: unit vectors, `(3, batch)`.
        uv: `(2, batch)`.
        footprint: `(2, 2, batch)`, or None for points.
    """

    wi: jax.Array
    wo: jax.Array
    uv: jax.Array
    footprint: jax.Array | None


def encode(query: Query) -> SpatialCoordinates:
    """The coordinates of a query of any shape, its batch flattened.

    Raises:
        ValueError: if the query has no uv.
    """
    if query.uv is None:
        raise ValueError("query.uv is None; a spatially varying model needs texture coordinates")
    footprint = None if query.footprint is None else jnp.moveaxis(query.footprint.reshape(-1, 2, 2), 0, -1)
    wi, wo, uv = (x.reshape(-1, x.shape[-1]).T for x in (query.wi, query.wo, query.uv))
    return SpatialCoordinates(wi, wo, uv, footprint)


def spatial_model(
    init: Callable[[jax.Array], Params], decode: Callable[[Params, SpatialCoordinates], jax.Array]
) -> Model:
    """The record of a model whose `decode` takes `SpatialCoordinates` and returns log f as `(3, batch)`."""

    def evaluate(params: Params, query: Query) -> jax.Array:
        return reflectance(decode(params, encode(query)).T.reshape(*query.wi.shape[:-1], 3), query)

    return Model(init, encode, decode, evaluate)


def init_latents(key: jax.Array, texture: LatentTexture) -> Pyramid:
    """Independent normal latents on every level."""
    layout = texture.layout
    return Pyramid(layout, FIRST_DEVIATION * jax.random.normal(key, (layout.texels, texture.channels)))


def latents_at(pyramid: Pyramid, coordinates: SpatialCoordinates, *, probes: int) -> jax.Array:
    """z, `(channels, batch)`: under the footprint, or at the point where there is none."""
    uv = coordinates.uv.T
    if coordinates.footprint is None:
        return bilinear(pyramid.layout, pyramid.texels, uv).T
    footprint = jnp.moveaxis(coordinates.footprint, -1, 0)
    return anisotropic(pyramid.layout, pyramid.texels, uv, footprint, probes=probes).T
