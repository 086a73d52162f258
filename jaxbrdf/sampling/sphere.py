"""The unit square on the whole sphere, with density and inverse."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import azimuth
from jaxbrdf.core.numerics import safe_sqrt


def square_to_sphere(u: jax.Array) -> jax.Array:
    """Direction uniform over the sphere: z = 1 - 2 u0 (Archimedes), azimuth 2 pi u1."""
    z = 1.0 - 2.0 * u[..., 0]
    r = 2.0 * safe_sqrt(u[..., 0] * (1.0 - u[..., 0]))
    phi = 2.0 * jnp.pi * u[..., 1]
    return jnp.stack([r * jnp.cos(phi), r * jnp.sin(phi), z], axis=-1)


def sphere_to_square(w: jax.Array) -> jax.Array:
    """Inverse of `square_to_sphere`; the azimuth lands in [0, 1)."""
    return jnp.stack([0.5 * (1.0 - w[..., 2]), jnp.mod(azimuth(w) / (2.0 * jnp.pi), 1.0)], axis=-1)


def sphere_density(w: jax.Array) -> jax.Array:
    """1 / (4 pi) everywhere."""
    return jnp.full_like(w[..., 2], 0.25 / jnp.pi)
