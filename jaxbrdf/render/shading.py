"""A point that a camera's ray meets: what a material is asked there, and the frame that the answer is in."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.types import Query


class Place(NamedTuple):
    """A point of a surface as its viewer sees it.

    Attributes:
        wo: to the viewer in the surface's frame, `(..., 3)`.
        uv, footprint: as in `Query`; None on a surface without texture.
    """

    wo: jax.Array
    uv: jax.Array | None = None
    footprint: jax.Array | None = None


class Shading(NamedTuple):
    """Where a camera's ray meets a surface.

    Attributes:
        hit: whether it does, `(...)`; the rest has usable values also where it does not.
        frame: rows tangent, bitangent and normal in the world, `(..., 3, 3)`.
        place: what is seen there.
    """

    hit: jax.Array
    frame: jax.Array
    place: Place


def query_of(place: Place, wi: jax.Array) -> Query:
    """What a material is asked for light from wi `(..., 3)`, in the frame; wi may have more axes in front."""

    def repeated(part: jax.Array | None) -> jax.Array | None:
        if part is None:
            return None
        return jnp.broadcast_to(part, (*wi.shape[:-1], *part.shape[place.wo.ndim - 1 :]))

    return Query(wi, jnp.broadcast_to(place.wo, wi.shape), repeated(place.uv), repeated(place.footprint))


def to_local(frame: jax.Array, w: jax.Array) -> jax.Array:
    """World direction `(..., 3)` in the frame."""
    return jnp.sum(frame * w[..., None, :], axis=-1)


def to_world(frame: jax.Array, w: jax.Array) -> jax.Array:
    """Local direction `(..., 3)` in the world."""
    return jnp.sum(frame * w[..., :, None], axis=-2)
