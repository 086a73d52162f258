"""Weights that combine draws from two densities without bias (Veach and Guibas 1995)."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_divide


def balance_heuristic(own: jax.Array, other: jax.Array) -> jax.Array:
    """own / (own + other): the weight of a draw from `own` where one was also taken from `other`; zero if both are."""
    return safe_divide(own, own + other)


def power_heuristic(own: jax.Array, other: jax.Array) -> jax.Array:
    """own^2 / (own^2 + other^2), by the ratio of the smaller to the larger, whose square cannot overflow."""
    larger = jnp.maximum(own, other)
    ratio = safe_divide(jnp.minimum(own, other), larger)
    minor = ratio * ratio / (1.0 + ratio * ratio)
    return jnp.where(larger > 0, jnp.where(own >= other, 1.0 - minor, minor), 0.0)
