"""Bounds by transformation: every parameter as a smooth, rising function of a free number.

A solver without constraints then never leaves the valid ranges that the parameters' records declare
(`jaxbrdf.core.ranges`).
"""

from __future__ import annotations

import math
from typing import Any

import jax
import jax.numpy as jnp

from jaxbrdf.core.ranges import Range, ranges_of

WIDE = 100.0
"""Ratio of the ends from which on a range is walked in the logarithm, such as roughness from 1e-4 to 1."""

EDGE = 1e-3
"""How near to an end, as a share of the range, a start may lie: the transformation is flat at the ends themselves."""


def to_free(params: Any) -> Any:
    """The free numbers, in the records' own structure, whose `from_free` is `params`, taken `EDGE` inside its range."""
    leaves, structure = jax.tree.flatten(params)
    free = [_free(leaf, valid) for leaf, valid in zip(leaves, ranges_of(params), strict=True)]
    return jax.tree.unflatten(structure, free)


def from_free(free: Any) -> Any:
    """Valid parameters of free numbers: inverse of `to_free`."""
    leaves, structure = jax.tree.flatten(free)
    values = [_bounded(leaf, valid) for leaf, valid in zip(leaves, ranges_of(free), strict=True)]
    return jax.tree.unflatten(structure, values)


def _bounded(t: jax.Array, valid: Range) -> jax.Array:
    if math.isinf(valid.low):
        return t
    if math.isinf(valid.high):
        return valid.low + jnp.exp(t)
    if _is_wide(valid):
        value = valid.low * jnp.exp(math.log(valid.high / valid.low) * jax.nn.sigmoid(t))
        # the product may round to more than the end
        return jnp.minimum(value, valid.high)
    return valid.low + (valid.high - valid.low) * jax.nn.sigmoid(t)


def _free(value: jax.Array, valid: Range) -> jax.Array:
    if math.isinf(valid.low):
        return value
    if math.isinf(valid.high):
        return jnp.log(jnp.maximum(value - valid.low, EDGE))
    if _is_wide(valid):
        share = jnp.log(value / valid.low) / math.log(valid.high / valid.low)
    else:
        share = (value - valid.low) / (valid.high - valid.low)
    return jax.scipy.special.logit(jnp.clip(share, EDGE, 1.0 - EDGE))


def _is_wide(valid: Range) -> bool:
    return valid.low > 0 and valid.high / valid.low > WIDE
