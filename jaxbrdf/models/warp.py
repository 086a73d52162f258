"""Learned radial warps of angular textures (Timonen et al., Eq. 7)."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import tiny

LEAST_EXPONENT = 0.5


class RadialWarp(NamedTuple):
    """Raw parameters of r' = sum_k w_k r^alpha_k, one warp for all queries or one for each.

    Attributes:
        logits: `(k,)` or `(k, batch)`; w = softmax(logits), a partition of unity.
        exponents: of the same shape; alpha = 1/2 + softplus(exponents), bounded from below by 1/2.
    """

    logits: jax.Array
    exponents: jax.Array


def init(exponents: tuple[float, ...]) -> RadialWarp:
    """Equal shares of the given exponents alpha_k, each above 1/2; (1, 1) is the identity."""
    above = jnp.asarray(exponents) - LEAST_EXPONENT
    return RadialWarp(jnp.zeros(len(exponents)), jnp.log(jnp.expm1(above)))


def from_rows(rows: jax.Array) -> RadialWarp:
    """A warp for each query, of `(2 k, batch)`: logits, then exponents, each a difference from the identity's."""
    logits, exponents = jnp.split(rows, 2)
    return RadialWarp(logits, exponents + jnp.log(jnp.expm1(1.0 - LEAST_EXPONENT)))


def shares_and_exponents(params: RadialWarp) -> tuple[jax.Array, jax.Array]:
    """w_k and alpha_k of Eq. 7, of the record's shape."""
    return jax.nn.softmax(params.logits, axis=0), LEAST_EXPONENT + jax.nn.softplus(params.exponents)


def apply(params: RadialWarp, r: jax.Array) -> jax.Array:
    """r' in [0, 1] for r in [0, 1], `(batch,)`; the disk's centre and rim stay where they are."""
    shares, exponents = (part.reshape(part.shape[0], -1) for part in shares_and_exponents(params))
    log_r = jnp.log(jnp.maximum(r, tiny(r)))
    return jnp.sum(shares * jnp.exp(exponents * log_r[None]), axis=0)
