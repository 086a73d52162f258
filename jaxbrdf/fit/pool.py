"""Pools of training queries: drawn, evaluated and encoded once, then read many times."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.fit.batch import Batch
from jaxbrdf.types import Query

DrawWeighted = Callable[[jax.Array, int], tuple[Query, jax.Array]]
CHUNK = 2**17


def draw_pool(
    key: jax.Array,
    count: int,
    draw: DrawWeighted,
    truth: Callable[[Query], jax.Array],
    encode: Callable[[Query], Any],
) -> Batch:
    """`count` queries in random order, on the host.

    Queries whose importance is zero, those below the horizon, are replaced by further draws; the others' importance is
    scaled by the share that was kept, so that its mean stays one.

    Args:
        key: chooses the queries.
        count: how many.
        draw: `(key, n) -> (query, importance)`.
        truth: `query -> f`, `(n, 3)`.
        encode: a model's.
    """
    kept: list[Batch] = []
    drawn = found = 0
    while found < count:
        chunk = _encoded(jax.random.fold_in(key, drawn), CHUNK, draw, truth, encode)
        batch = jax.tree.map(np.asarray, chunk)
        lit = batch.importance > 0
        kept.append(jax.tree.map(lambda leaf, lit=lit: leaf[..., lit], batch))
        drawn, found = drawn + 1, found + int(lit.sum())
    share = np.float32(found / (drawn * CHUNK))
    pool = jax.tree.map(lambda *leaves: np.concatenate(leaves, axis=-1)[..., :count], *kept)
    return pool._replace(importance=pool.importance * share)


# compiled once for all pools of a fit, which has at least two
@partial(jax.jit, static_argnums=(1, 2, 3, 4))
def _encoded(key: jax.Array, count: int, draw: DrawWeighted, truth: Callable, encode: Callable) -> Batch:
    """One chunk of draws in random order: neighbours in a pool become batches."""
    key_draw, key_order = jax.random.split(key)
    query, importance = draw(key_draw, count)
    order = jax.random.permutation(key_order, count)
    query = Query(query.wi[order], query.wo[order])
    return Batch(encode(query), jnp.moveaxis(truth(query), -1, 0), importance[order])
