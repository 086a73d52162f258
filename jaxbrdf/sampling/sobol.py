"""Evenly spread points for renderings: Sobol's sequence, turned at random for each pixel."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import qmc


def sobol_points(count: int, dimensions: int) -> np.ndarray:
    """The first points of Sobol's sequence, `(count, dimensions)` float32 in [0, 1), most even at powers of two.

    Raises:
        ValueError: a count below one.
    """
    if count < 1:
        raise ValueError(f"count is {count}; it must be at least 1")
    points = qmc.Sobol(dimensions, scramble=False).random_base2((count - 1).bit_length())
    return points[:count].astype(np.float32)


def rotate(points: jax.Array, shift: jax.Array) -> jax.Array:
    """`points` moved around the unit torus by `shift`; a uniform shift makes each uniform (Cranley, Patterson 1976)."""
    moved = points + shift
    # a sum just below a whole number can round up to it
    return jnp.minimum(moved - jnp.floor(moved), 1.0 - jnp.finfo(moved.dtype).epsneg)
