"""A fast arctangent of two arguments: XLA's own costs as much on the CPU as a small network."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_divide

COEFFICIENTS = (
    1.0,
    -0.33333152532577515,
    0.19993773102760315,
    -0.14211055636405945,
    0.10666004568338394,
    -0.07552213221788406,
    0.04321185126900673,
    -0.016367921605706215,
    0.002920690691098571,
)
"""Minimax polynomial in x^2 for atan(x) / x on [0, 1], by experiments/derive_polynomials.py.

Largest relative error 1.7e-8 in exact arithmetic, 1.3e-7 in float32: two units in the last place.
"""


def fast_atan2(y: jax.Array, x: jax.Array) -> jax.Array:
    """Angle of (x, y) in [-pi, pi] to 3e-7 relative, `(...)`; zero at the origin. A signed zero y keeps its sign."""
    across, up = jnp.abs(x), jnp.abs(y)
    ratio = safe_divide(jnp.minimum(across, up), jnp.maximum(across, up))
    square = ratio * ratio
    value = jnp.full_like(square, COEFFICIENTS[-1])
    for coefficient in COEFFICIENTS[-2::-1]:
        value = value * square + coefficient
    angle = value * ratio
    angle = jnp.where(up > across, 0.5 * jnp.pi - angle, angle)
    return jnp.copysign(jnp.where(x < 0, jnp.pi - angle, angle), y)
