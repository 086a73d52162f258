"""Evenly spread points for renderings: an additive recurrence, shifted at random."""

from __future__ import annotations

import jax
import jax.numpy as jnp


def lattice_points(shift: jax.Array, index: jax.Array) -> jax.Array:
    """The index-th point of a shifted Kronecker sequence, `(..., d)` in [0, 1).

    Steps are the powers of the inverse of the root of x^(d + 1) = x + 1 (Roberts 2018), kept as 32-bit fractions so
    that they add without rounding. With a uniform shift every point is uniform, so means over them are unbiased.

    Args:
        shift: uniform in [0, 1), `(..., d)`, the same for all indices of one integral.
        index: integer, `()`.
    """
    dimensions = shift.shape[-1]
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = jnp.array([int((root**-k % 1.0) * 2**32) for k in range(1, dimensions + 1)], jnp.uint32)
    turned = index.astype(jnp.uint32) * steps
    fraction = (turned >> 8).astype(shift.dtype) * 2.0**-24
    point = shift + jnp.reshape(fraction, (1,) * (shift.ndim - 1) + (dimensions,))
    return point - jnp.floor(point)
