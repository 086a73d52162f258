"""The power law y^-p on [1, Y]: its mass and its draws, in logarithms and smooth through p = 1.

A microfacet distribution whose tail is a power draws its half vectors by it. With e = 1 - p and L = log Y the mass is
(Y^e - 1) / e = L phi(e L), phi(x) = (exp(x) - 1) / x.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp


def power_mass(log_end: jax.Array, exponent: jax.Array) -> jax.Array:
    """Integral of y^-exponent over y from 1 to exp(log_end)."""
    return log_end * _phi((1.0 - exponent) * log_end)


def power_draw(log_end: jax.Array, exponent: jax.Array, u: jax.Array) -> jax.Array:
    """log y below which the share u of the mass lies: log(1 + u (Y^e - 1)) / e, which is u L at e = 0.

    Both logarithm and exponential are taken of one plus a small number, so that the quotient keeps its digits until
    e L is smaller than the dtype's epsilon; from there on u L is exact.
    """
    e = 1.0 - exponent
    flat = jnp.abs(e * log_end) < jnp.finfo(log_end.dtype).eps
    safe = jnp.where(flat, 1.0, e)
    return jnp.where(flat, u * log_end, jnp.log1p(u * jnp.expm1(safe * log_end)) / safe)


def _phi(x: jax.Array) -> jax.Array:
    """(exp(x) - 1) / x; its series to x^2 where |x|^3 / 24 is below the dtype's epsilon."""
    near = jnp.abs(x) < jnp.finfo(x.dtype).eps ** (1.0 / 3.0)
    safe = jnp.where(near, 1.0, x)
    small = jnp.where(near, x, 0.0)
    return jnp.where(near, 1.0 + small * (0.5 + small / 6.0), jnp.expm1(safe) / safe)
