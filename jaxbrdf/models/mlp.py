"""Fully connected networks with the batch along the last axis.

Features come first, `(features, batch)`: every product then runs along the batch, which is two to five times faster on
processors for layers this narrow, and it is the order of the OpenCL kernels' buffers too.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import jax
import jax.numpy as jnp


class Mlp(NamedTuple):
    """Weights `(n_in, n_out)` and biases `(n_out,)` of each layer."""

    weights: tuple[jax.Array, ...]
    biases: tuple[jax.Array, ...]


def init(key: jax.Array, sizes: tuple[int, ...]) -> Mlp:
    """Normal weights of variance 1 / n_in (LeCun) and zero biases for layers `sizes[0] -> ... -> sizes[-1]`."""
    keys = jax.random.split(key, len(sizes) - 1)
    shapes = list(pairwise(sizes))
    weights = tuple(jax.random.normal(k, s) / jnp.sqrt(s[0]) for k, s in zip(keys, shapes, strict=True))
    return Mlp(weights, tuple(jnp.zeros(n) for _, n in shapes))


def apply(params: Mlp, x: jax.Array) -> jax.Array:
    """SiLU after every layer but the last: `(n_in, batch)` to `(n_out, batch)`."""
    *hidden, last = zip(params.weights, params.biases, strict=True)
    for weight, bias in hidden:
        x = silu(weight.T @ x + bias[:, None])
    weight, bias = last
    return weight.T @ x + bias[:, None]


@jax.custom_jvp
def silu(x: jax.Array) -> jax.Array:
    """x sigmoid(x), as `jax.nn.silu`, with a derivative made of the sigmoid that the value already needed."""
    return x * jax.nn.sigmoid(x)


@silu.defjvp
def _silu_jvp(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
    (x,), (dx,) = primals, tangents
    sigmoid = jax.nn.sigmoid(x)
    value = x * sigmoid
    return value, dx * (sigmoid + value * (1.0 - sigmoid))
