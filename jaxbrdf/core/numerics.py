"""Forms of common functions whose value and gradient stay finite at their singular points."""

from __future__ import annotations

from functools import reduce

import jax
import jax.numpy as jnp


def tiny(x: jax.Array) -> jax.Array:
    """4 times the least normal number of x's dtype: its reciprocal and its square root are normal numbers too.

    float32: 4.7e-38, reciprocal 2.1e37. Below it a division overflows or the processor flushes to zero.
    """
    return jnp.asarray(4.0 * jnp.finfo(x.dtype).tiny, x.dtype)


def safe_sqrt(x: jax.Array) -> jax.Array:
    """sqrt(max(x, 0)), with gradient zero instead of infinity where x <= 0."""
    positive = x > tiny(x)
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, x, 1.0)), 0.0)


def safe_divide(a: jax.Array, b: jax.Array) -> jax.Array:
    """a / b where |b| is a normal number, zero elsewhere; its gradient is zero there too."""
    usable = jnp.abs(b) > tiny(b)
    return jnp.where(usable, a / jnp.where(usable, b, 1.0), 0.0)


def difference_of_products(a: jax.Array, b: jax.Array, c: jax.Array, d: jax.Array) -> jax.Array:
    """a b - c d within two units in the last place of the result, however much the products cancel.

    The rounding errors of both products are added back (Dekker 1971). Entries must stay below the square root of the
    dtype's largest number over 2^12.
    """
    high, other = a * b, c * d
    return (high - other) + (_product_error(a, b, high) - _product_error(c, d, other))


def _product_error(a: jax.Array, b: jax.Array, product: jax.Array) -> jax.Array:
    """a b - fl(a b), exact, and of gradient zero."""
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return jax.lax.stop_gradient(error)


def _halves(x: jax.Array) -> tuple[jax.Array, jax.Array]:
    """x as a sum of two numbers of half as many digits, whose products are exact (Veltkamp's splitting)."""
    digits = jnp.finfo(jnp.asarray(x).dtype).nmant + 1
    scaled = float(2 ** ((digits + 1) // 2) + 1) * x
    high = scaled - (scaled - x)
    return high, x - high


def safe_norm(v: jax.Array) -> jax.Array:
    """Euclidean length over the last axis, with gradient zero at the zero vector."""
    return safe_sqrt(sum_of_squares(v))


def sum_of_squares(v: jax.Array) -> jax.Array:
    """|v|^2 over the last axis, spelled out: a reduction over two or three numbers is ten times slower."""
    return reduce(jnp.add, (v[..., i] * v[..., i] for i in range(v.shape[-1])))


def safe_normalize(v: jax.Array) -> jax.Array:
    """v / |v|, `(..., 3)`; the normal (0, 0, 1) for vectors too short to have a direction."""
    length = safe_norm(v)[..., None]
    usable = length > 0
    return jnp.where(usable, v / jnp.where(usable, length, 1.0), jnp.asarray((0.0, 0.0, 1.0), v.dtype))


def safe_atan2(y: jax.Array, x: jax.Array) -> jax.Array:
    """atan2(y, x), which is zero with gradient zero at the origin."""
    at_origin = (jnp.abs(x) <= tiny(x)) & (jnp.abs(y) <= tiny(y))
    return jnp.where(at_origin, 0.0, jnp.arctan2(y, jnp.where(at_origin, 1.0, x)))


def safe_acos(x: jax.Array) -> jax.Array:
    """acos of x clamped to [-1, 1], with gradient zero where the slope is infinite."""
    inside = jnp.abs(x) < 1.0
    edge = jnp.where(x > 0, 0.0, jnp.pi).astype(x.dtype)
    return jnp.where(inside, jnp.arccos(jnp.where(inside, x, 0.0)), edge)


def match_rank(x: jax.Array, rank: int) -> jax.Array:
    """x with axes of length one put in front until it has `rank` of them: explicit where numpy would promote."""
    return jnp.reshape(x, (1,) * (rank - jnp.ndim(x)) + jnp.shape(x))
