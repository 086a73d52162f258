"""An elevation's coordinate that is even where reflectance changes towards the horizon: t = 1 - cos^(1/4).

Zero at the normal, one at the horizon. Equal steps of t are nearly equal factors of the cosine near the horizon, where
fitted reflectance grows like a power of it: of twelve steps the last begins at 5e-5, the first ends at 0.7.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.smith import LEAST_COSINE


def grazing(w: jax.Array) -> jax.Array:
    """t of directions `(..., 3)`, `(...)`, those below the horizon taken as on it.

    The cosine counts from `LEAST_COSINE` on, so the slope is at most 1 / (4 LEAST_COSINE^(3/4)) = 7e4, and t 0.984.
    """
    return 1.0 - jnp.sqrt(jnp.sqrt(jnp.maximum(w[..., 2], LEAST_COSINE)))


def view_at(t: jax.Array, phi: jax.Array) -> jax.Array:
    """The direction `(..., 3)` of coordinate t and azimuth phi, both `(...)`."""
    cos = (1.0 - t) ** 4
    sin = jnp.sqrt((1.0 - cos) * (1.0 + cos))
    return jnp.stack([sin * jnp.cos(phi), sin * jnp.sin(phi), cos], axis=-1)
