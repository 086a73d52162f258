"""A cosine lobe about a tilted normal, on the sphere of directions (Zeltner et al. 2024, Eq. 6).

The normal is that of a facet with slopes (mu_x, mu_y): n = (-mu_x, -mu_y, 1) / |...|. The sphere's frame turns with it
by the shortest way, which is defined for every n with n_z > -1. Where the facet is steep a part of the lobe lies below
the horizon.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import dot
from jaxbrdf.sampling.hemisphere import cosine_to_square, square_to_cosine


class Tilt(NamedTuple):
    """Slopes along x and y, `()` or the batch shape."""

    slope_x: jax.Array
    slope_y: jax.Array


def square_to_tilted(tilt: Tilt, u: jax.Array) -> jax.Array:
    """Direction with density max(w . n, 0) / pi from u in [0, 1]^2, `(..., 2)` to `(..., 3)`."""
    return _turn(square_to_cosine(u), tilted_normal(tilt))


def tilted_to_square(tilt: Tilt, w: jax.Array) -> jax.Array:
    """Inverse of `square_to_tilted`."""
    n = tilted_normal(tilt)
    return cosine_to_square(_turn(w, jnp.stack([-n[..., 0], -n[..., 1], n[..., 2]], axis=-1)))


def tilted_density(tilt: Tilt, w: jax.Array) -> jax.Array:
    """max(w . n, 0) / pi, below the horizon too."""
    return jnp.maximum(dot(w, tilted_normal(tilt)), 0.0) / jnp.pi


def tilted_normal(tilt: Tilt) -> jax.Array:
    """n = (-mu_x, -mu_y, 1) / sqrt(1 + mu_x^2 + mu_y^2), `(..., 3)` (Eq. 6)."""
    x, y = jnp.broadcast_arrays(tilt.slope_x, tilt.slope_y)
    z = 1.0 / jnp.sqrt(1.0 + x * x + y * y)
    return jnp.stack([-x * z, -y * z, z], axis=-1)


def _turn(w: jax.Array, n: jax.Array) -> jax.Array:
    """w under the rotation about z x n that takes z to n (Rodrigues' formula, with 1 + n_z the only divisor).

    R w = (w_x + a n_x, w_y + a n_y, w_z n_z - n_x w_x - n_y w_y) with a = w_z - (n_x w_x + n_y w_y) / (1 + n_z).
    """
    across = n[..., 0] * w[..., 0] + n[..., 1] * w[..., 1]
    a = w[..., 2] - across / (1.0 + n[..., 2])
    return jnp.stack([w[..., 0] + a * n[..., 0], w[..., 1] + a * n[..., 1], w[..., 2] * n[..., 2] - across], axis=-1)
