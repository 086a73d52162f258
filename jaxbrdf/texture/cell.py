"""The four texels around a place on a level of a pyramid: read with bilinear weights, and the transposes of reading.

All functions take a batch of places, coordinates and levels of shape `(batch,)`, and rows `(batch, channels)`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.texture.pyramid import Layout, Wrap


class Edge(NamedTuple):
    """A place between two texels of an axis, each `(batch,)`.

    Attributes:
        low, high: numbers of the two texels.
        along: the fraction beyond the lower one, in [0, 1].
        slope: its derivative by the coordinate.
    """

    low: jax.Array
    high: jax.Array
    along: jax.Array
    slope: jax.Array


class Cell(NamedTuple):
    """The texels around a batch of places, as rows of a pyramid.

    Attributes:
        corners: upper left, upper right, lower left and lower right, `(batch,)` each.
        x, y: the place between columns and between rows.
    """

    corners: tuple[jax.Array, ...]
    x: Edge
    y: Edge


def cell(layout: Layout, u: jax.Array, v: jax.Array, level: jax.Array) -> Cell:
    """The cell of each place on its level, or on one level for all; within the pyramid whatever the coordinates."""
    rows, columns = (jnp.maximum(jnp.right_shift(jnp.int32(n), level), 1) for n in (layout.height, layout.width))
    start = rows_of(jnp.asarray(layout.offsets, jnp.int32), level)
    x, y = _edge(layout.wrap, u, columns), _edge(layout.wrap, v, rows)
    upper, lower = start + y.low * columns, start + y.high * columns
    return Cell((upper + x.low, upper + x.high, lower + x.low, lower + x.high), x, y)


def fetch(texels: jax.Array, at: Cell) -> jax.Array:
    """Bilinear values: corner by corner, of which XLA makes one loop, where all at once would be stored first."""
    a, b, c, d = (
        rows_of(texels, index) * weight[:, None] for index, weight in zip(at.corners, _weights(at), strict=True)
    )
    return (a + b) + (c + d)


def scatter(into: jax.Array, at: Cell, rows: jax.Array) -> jax.Array:
    """The transpose of `fetch`: rows times the weights, added to the corners of the pyramid `into`."""
    for index, weight in zip(at.corners, _weights(at), strict=True):
        into = into.at[index].add(rows * weight[:, None], mode="promise_in_bounds")
    return into


def along_slopes(texels: jax.Array, at: Cell, rows: jax.Array) -> jax.Array:
    """Products of rows with the derivatives of `fetch` by u and v, `(batch, 2)`."""
    a, b, c, d = (jnp.sum(rows * rows_of(texels, index), axis=1) for index in at.corners)
    x, y = at.x, at.y
    by_u = x.slope * ((b - a) * (1 - y.along) + (d - c) * y.along)
    by_v = y.slope * ((c - a) * (1 - x.along) + (d - b) * x.along)
    return jnp.stack([by_u, by_v], axis=1)


def in_period(wrap: Wrap, x: jax.Array) -> jax.Array:
    """x less whole periods: in [0, 1], mirrored in [0, 2]; clamped textures have none."""
    if wrap == "repeat":
        return x - jnp.floor(x)
    return x - 2.0 * jnp.floor(0.5 * x) if wrap == "mirror" else x


def rows_of(table: jax.Array, index: jax.Array) -> jax.Array:
    """Rows of a table, of which all are there: XLA need not look."""
    return table.at[index].get(mode="promise_in_bounds")


def _weights(at: Cell) -> tuple[jax.Array, ...]:
    x, y = at.x.along, at.y.along
    return (1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y


def _edge(wrap: Wrap, x: jax.Array, count: jax.Array) -> Edge:
    """Between which of `count` texels x stands, their centres at (j + 1/2) / count; of a NaN the fraction is NaN."""
    size = count.astype(x.dtype)
    inside, slope = _folded(wrap, x, size)
    at = inside * size - 0.5
    lower = jnp.floor(at)
    index = jnp.clip(lower.astype(jnp.int32), -1, count - 1)
    if wrap == "repeat":
        low, high = jnp.where(index < 0, count - 1, index), jnp.where(index + 1 < count, index + 1, 0)
    else:
        low, high = jnp.maximum(index, 0), jnp.minimum(index + 1, count - 1)
    return Edge(low, high, at - lower, slope)


def _folded(wrap: Wrap, x: jax.Array, size: jax.Array) -> tuple[jax.Array, jax.Array]:
    """x in [0, 1], brought there before it is multiplied, so that no more digits are lost; and its slope in texels."""
    x = in_period(wrap, x)
    if wrap == "repeat":
        return x, size
    if wrap == "clamp":
        return jnp.clip(x, 0.0, 1.0), size
    return jnp.minimum(x, 2.0 - x), jnp.where(x > 1.0, -size, size)
