"""The unit square on the hemisphere about the normal, with densities per solid angle and inverses."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.disk import disk_to_square, square_to_disk
from jaxbrdf.core.numerics import safe_sqrt


def square_to_cosine(u: jax.Array) -> jax.Array:
    """Direction with density cos / pi from u in [0, 1]^2 (`(..., 2)` to `(..., 3)`): a disk lifted to the sphere."""
    p = square_to_disk(u)
    z = safe_sqrt(1.0 - p[..., 0] ** 2 - p[..., 1] ** 2)
    return jnp.concatenate([p, z[..., None]], axis=-1)


def cosine_to_square(w: jax.Array) -> jax.Array:
    """Inverse of `square_to_cosine`."""
    return disk_to_square(w[..., :2])


def cosine_density(w: jax.Array) -> jax.Array:
    """max(cos, 0) / pi."""
    return jnp.maximum(w[..., 2], 0.0) / jnp.pi


def square_to_uniform(u: jax.Array) -> jax.Array:
    """Direction uniform over the hemisphere: the equal-area disk with z = 1 - r^2, r -> r sqrt(2 - r^2)."""
    p = square_to_disk(u)
    squared = p[..., 0] ** 2 + p[..., 1] ** 2
    return jnp.concatenate([p * safe_sqrt(2.0 - squared)[..., None], (1.0 - squared)[..., None]], axis=-1)


def uniform_to_square(w: jax.Array) -> jax.Array:
    """Inverse of `square_to_uniform`."""
    return disk_to_square(w[..., :2] / jnp.sqrt(1.0 + jnp.maximum(w[..., 2:], 0.0)))


def uniform_density(w: jax.Array) -> jax.Array:
    """1 / (2 pi) above the horizon."""
    return jnp.where(w[..., 2] > 0, 0.5 / jnp.pi, 0.0)
