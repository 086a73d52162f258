"""An orthographic camera that looks down the world's -z at the unit disk; y is up and the image's first row the top."""

from __future__ import annotations

import jax
import jax.numpy as jnp

# The disk's diameter as a share of the image's shorter side.
FILL = 0.95


def film_points(pixel: jax.Array, offset: jax.Array, height: int, width: int) -> jax.Array:
    """World x and y `(..., 2)` seen through flat pixel indices `(...)` at offsets `(..., 2)` in [0, 1)^2."""
    scale = 2.0 / (FILL * min(height, width))
    x = (pixel % width + offset[..., 0] - 0.5 * width) * scale
    y = (0.5 * height - pixel // width - offset[..., 1]) * scale
    return jnp.stack([x, y], axis=-1)
