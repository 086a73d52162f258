"""From a decoder over flat batches to a model over queries of any shape."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import above_horizon
from jaxbrdf.types import Model, Params, Query

LARGEST_LOG = 80.0
"""exp(80) = 5.5e34: four decades below float32's largest number, room for a weight and a sum."""


def reflectance(log_f: jax.Array, query: Query) -> jax.Array:
    """f = exp(log f), zero where either direction is below the horizon, `(..., 3)`."""
    f = jnp.exp(jnp.minimum(log_f, LARGEST_LOG))
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def model(
    init: Callable[[jax.Array], Params],
    encode: Callable[[Query], Any],
    decode: Callable[[Params, Any], jax.Array],
) -> Model:
    """The record of a model whose `decode` takes coordinates of shape `(batch,)` and returns log f as `(3, batch)`."""

    def evaluate(params: Params, query: Query) -> jax.Array:
        coordinates = encode(query)
        batch = jax.tree.leaves(coordinates)[0].shape
        rows = decode(params, jax.tree.map(jnp.ravel, coordinates))
        return reflectance(rows.T.reshape(*batch, 3), query)

    return Model(init, encode, decode, evaluate)
