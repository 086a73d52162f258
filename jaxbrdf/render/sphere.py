"""The unit sphere at the origin, seen from far up the z axis: every viewing angle once, with a frame to shade in."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_divide, safe_sqrt
from jaxbrdf.render.shading import Place, Shading


def intersect(film: jax.Array) -> Shading:
    """The sphere under film points `(..., 2)`; what misses gets the frame of the point nearest to the viewer.

    The tangent runs along the circles of latitude about the world's y axis, eastwards.
    """
    squared = film[..., 0] ** 2 + film[..., 1] ** 2
    hit = squared < 1.0
    x, y = (jnp.where(hit, film[..., i], 0.0) for i in (0, 1))
    z = safe_sqrt(1.0 - jnp.where(hit, squared, 0.0))
    frame = _frame(x, y, z)
    return Shading(hit, frame, Place(frame[..., :, 2]))


def _frame(x: jax.Array, y: jax.Array, z: jax.Array) -> jax.Array:
    """Tangent (z, 0, -x) / |.|, the x axis at the poles; bitangent n x t; normal."""
    length = safe_sqrt(x * x + z * z)
    along = jnp.where(length > 0, safe_divide(z, length), 1.0)
    back = safe_divide(-x, length)
    zero = jnp.zeros_like(x)
    tangent = jnp.stack([along, zero, back], axis=-1)
    bitangent = jnp.stack([y * back, z * along - x * back, -y * along], axis=-1)
    return jnp.stack([tangent, bitangent, jnp.stack([x, y, z], axis=-1)], axis=-2)
