"""Learned radial warps of angular textures (Timonen et al., Eq. 7)."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import tiny

LEAST_EXPONENT = 0.5


class RadialWarp(NamedTuple):
    """Raw parameters of r' = sum_k w_k r^alpha_k.

    Attributes:
        logits: `(k,)`; w = softmax(logits), a partition of unity.
        exponents: `(k,)`; alpha = 1/2 + softplus(exponents), bounded from below by 1/2.
    """

    logits: jax.Array
    exponents: jax.Array


def init(exponents: tuple[float, ...]) -> RadialWarp:
    """Equal shares of the given exponents alpha_k, each above 1/2; (1, 1) is the identity."""
    above = jnp.asarray(exponents) - LEAST_EXPONENT
    return RadialWarp(jnp.zeros(len(exponents)), jnp.log(jnp.expm1(above)))


def shares_and_exponents(params: RadialWarp) -> tuple[jax.Array, jax.Array]:
    """w_k and alpha_k of Eq. 7, each `(k,)`."""
    return jax.nn.softmax(params.logits), LEAST_EXPONENT + jax.nn.softplus(params.exponents)


def apply(params: RadialWarp, r: jax.Array) -> jax.Array:
    """r' in [0, 1] for r in [0, 1], `(batch,)`; the disk's centre and rim stay where they are."""
    shares, exponents = shares_and_exponents(params)
    log_r = jnp.log(jnp.maximum(r, tiny(r)))
    return jnp.sum(shares[:, None] * jnp.exp(exponents[:, None] * log_r[None]), axis=0)
