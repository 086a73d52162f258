"""The unit square on the unit disk, areas kept, and back."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_divide


def square_to_disk(u: jax.Array) -> jax.Array:
    """Concentric map of [0, 1]^2 onto the unit disk (Shirley and Chiu 1997), `(..., 2)`; density 1 / pi."""
    a, b = 2.0 * u[..., 0] - 1.0, 2.0 * u[..., 1] - 1.0
    wide = jnp.abs(a) > jnp.abs(b)
    radius = jnp.where(wide, a, b)
    ratio = safe_divide(jnp.where(wide, b, a), radius)
    angle = jnp.where(wide, 0.25 * jnp.pi * ratio, 0.5 * jnp.pi - 0.25 * jnp.pi * ratio)
    return jnp.stack([radius * jnp.cos(angle), radius * jnp.sin(angle)], axis=-1)


def disk_to_square(p: jax.Array) -> jax.Array:
    """Inverse of `square_to_disk`, `(..., 2)` in [0, 1]^2; the centre of the disk is the centre of the square."""
    x, y = p[..., 0], p[..., 1]
    wide = jnp.abs(x) > jnp.abs(y)
    longer, shorter = jnp.where(wide, x, y), jnp.where(wide, y, x)
    # hypot, not the root of a sum of squares: its gradient is finite but at the origin, which is set apart.
    at_centre = longer == 0
    radius = jnp.sign(longer) * jnp.where(at_centre, 0.0, jnp.hypot(jnp.where(at_centre, 1.0, longer), shorter))
    along = radius * (4.0 / jnp.pi) * jnp.arctan(safe_divide(shorter, longer))
    square = jnp.where(wide[..., None], jnp.stack([radius, along], -1), jnp.stack([along, radius], -1))
    return 0.5 * (square + 1.0)
