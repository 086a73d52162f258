"""A cosine lobe about a tilted normal, on the sphere of directions (Zeltner et al. 2024, Eq. 6).

The normal is that of a facet with slopes (mu_x, mu_y): n = (-mu_x, -mu_y, 1) / |...|. The sphere's frame turns with it
by the shortest way, which is defined for every n with n_z > -1. Where the facet is steep a part of the lobe lies below
the horizon.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import dot, tilt, untilt
from jaxbrdf.sampling.hemisphere import cosine_to_square, square_to_cosine


class Tilt(NamedTuple):
    """Slopes along x and y, `()` or the batch shape."""

    slope_x: jax.Array
    slope_y: jax.Array


def square_to_tilted(slopes: Tilt, u: jax.Array) -> jax.Array:
    """Direction with density max(w . n, 0) / pi from u in [0, 1]^2, `(..., 2)` to `(..., 3)`."""
    return tilt(square_to_cosine(u), tilted_normal(slopes))


def tilted_to_square(slopes: Tilt, w: jax.Array) -> jax.Array:
    """Inverse of `square_to_tilted`."""
    return cosine_to_square(untilt(w, tilted_normal(slopes)))


def tilted_density(slopes: Tilt, w: jax.Array) -> jax.Array:
    """max(w . n, 0) / pi, below the horizon too."""
    return jnp.maximum(dot(w, tilted_normal(slopes)), 0.0) / jnp.pi


def tilted_normal(slopes: Tilt) -> jax.Array:
    """n = (-mu_x, -mu_y, 1) / sqrt(1 + mu_x^2 + mu_y^2), `(..., 3)` (Eq. 6)."""
    x, y = jnp.broadcast_arrays(slopes.slope_x, slopes.slope_y)
    z = 1.0 / jnp.sqrt(1.0 + x * x + y * y)
    return jnp.stack([-x * z, -y * z, z], axis=-1)
