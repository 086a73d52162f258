"""Where a training step's queries come from: read from a pool, or drawn in the step itself."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
from jax.sharding import PartitionSpec

from jaxbrdf.fit.batch import Batch

AXIS = "batch"
"""The name of the devices' axis."""

Draw = Callable[[jax.Array, Any, int], Batch]


class Piece(NamedTuple):
    """Which part of a batch is asked for.

    Attributes:
        step: number of the step, int32 `()`.
        share: queries of a batch that a device takes.
        index: number of the piece within the share, int32 `()`.
        size: its queries.
    """

    step: jax.Array
    share: int
    index: jax.Array
    size: int


class Feed(NamedTuple):
    """A source of batches.

    Attributes:
        batch: `(data, piece) -> Batch`, on the device that asks.
        spec: `leaf -> PartitionSpec` of the data: how devices share them.
    """

    batch: Callable[[Any, Piece], Batch]
    spec: Callable[[jax.Array], PartitionSpec]


class Drawing(NamedTuple):
    """The data of a `drawn` feed.

    Attributes:
        seed: int32 `()`; a step's key is made of it, of the step, the device and the piece.
        truth: whatever the draws read.
    """

    seed: jax.Array
    truth: Any


def drawn(draw: Draw) -> Feed:
    """A feed of new queries in every step, `draw(key, truth, count) -> Batch`; all devices hold the truth."""

    def batch(data: Drawing, piece: Piece) -> Batch:
        key = jax.random.key(data.seed)
        for number in (piece.step, jax.lax.axis_index(AXIS), piece.index):
            key = jax.random.fold_in(key, number)
        return draw(key, data.truth, piece.size)

    return Feed(batch, lambda _: PartitionSpec())


def _from_pool(pool: Batch, piece: Piece) -> Batch:
    """The next queries of the device's part of a pool, which is read again from its beginning.

    Raises:
        ValueError: if the part does not hold a share.
    """
    held = pool.importance.shape[-1]
    if held < piece.share:
        raise ValueError(f"the pool holds {held} queries for each device; a batch takes {piece.share}")
    first = (piece.step % (held // piece.share)) * piece.share + piece.index * piece.size
    slice_ = partial(jax.lax.dynamic_slice_in_dim, start_index=first, slice_size=piece.size)
    return jax.tree.map(lambda leaf: slice_(leaf, axis=leaf.ndim - 1), pool)


def _last_axis(leaf: jax.Array) -> PartitionSpec:
    return PartitionSpec(*[None] * (leaf.ndim - 1), AXIS)


POOLED = Feed(_from_pool, _last_axis)
"""A pool of queries, of which every device holds a part."""
