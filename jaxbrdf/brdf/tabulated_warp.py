"""Densities on the unit square, as tables that depend on two parameters: value, warp from uniform, and its inverse.

The tables are bilinear inside a slice and linear between slices, after the supplement of Dupuy and Jakob (2018). x runs
along a table's last axis, y along the one before. Slices lie P times along the first parameter, T along the second.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.numerics import safe_divide, safe_sqrt
from jaxbrdf.core.staging import staged

ONE_MINUS = float(np.nextafter(np.float32(1.0), np.float32(0.0)))
"""The largest float32 below 1: a uniform of exactly 1 would fall off the last cell."""

NEARLY_FLAT = 1e-4
"""Relative difference d of a segment's ends below which its density counts as constant when it is inverted.

The quadratic's rounding error grows as eps / d, the error of the constant as d: they meet near sqrt(6e-8) = 2.4e-4 in
float32. Mitsuba's `Marginal2D` has 1e-4.
"""


Places = list[tuple[jax.Array, jax.Array]]
"""Positions in a flattened table and the weights of what stands there, `(...)` each."""


class Point(NamedTuple):
    """A point of the unit square, or two uniform numbers, `(...)` each."""

    x: jax.Array
    y: jax.Array


class Slices(NamedTuple):
    """Which slices a query falls between and their weights: one, two or four pairs of `(...)` arrays."""

    index: tuple[jax.Array, ...]
    weight: tuple[jax.Array, ...]


class Warp(NamedTuple):
    """A density with its integrals, each slice normalised to one; what is read together lies together.

    Attributes:
        cells: `(S, H, W, 3)`: the density at the node, at the next node along x, and its integral over x from 0 to the
            node. Nothing reads the last column's next node.
        rows: `(S, H, 3)`: the integral over all x, and y from 0 to the row; the integral over x at the row, and at the
            next. Nothing reads the last row's next.
    """

    cells: jax.Array
    rows: jax.Array


class Cell(NamedTuple):
    """A table's cell by its lower corner (integers), and the place within it in [0, 1]."""

    column: jax.Array
    row: jax.Array
    x: jax.Array
    y: jax.Array


def warp(density: np.ndarray) -> Warp:
    """The normalised density and its integrals, of a non-negative table `(S, H, W)`; in float64, kept in float32."""
    values = np.asarray(density, np.float64)
    across = _cumulative(values)
    along = _cumulative(across[:, :, -1])
    total = along[:, -1, None, None]
    cells = np.stack([values, np.roll(values, -1, axis=2), across], axis=-1) / total[..., None]
    rows = np.stack([along, across[:, :, -1], np.roll(across[:, :, -1], -1, axis=1)], axis=-1) / total
    return Warp(jnp.asarray(cells, jnp.float32), jnp.asarray(rows, jnp.float32))


def _cumulative(values: np.ndarray) -> np.ndarray:
    """Trapezoidal integral over [0, 1] along the last axis, from its start to each node."""
    sums = np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1) / (values.shape[-1] - 1)
    return np.concatenate([np.zeros_like(values[..., :1]), sums], axis=-1)


def slices(first: jax.Array, second: jax.Array, knots: tuple[jax.Array, jax.Array]) -> Slices:
    """The slices around parameters `first` and `second`, `(...)`, for their increasing knots `(P,)` and `(T,)`.

    Parameters outside the knots take the end's value. A parameter with one knot adds no slice to look up.
    """
    along_first, along_second = _bracket(first, knots[0]), _bracket(second, knots[1])
    pairs = [(p * len(knots[1]) + t, a * b) for p, a in along_first for t, b in along_second]
    return Slices(tuple(i for i, _ in pairs), tuple(w for _, w in pairs))


def one_slice(shape: tuple[int, ...]) -> Slices:
    """The only slice of a table that depends on nothing, for queries of this batch shape."""
    return Slices((jnp.zeros(shape, jnp.int32),), (jnp.ones(shape),))


def _bracket(value: jax.Array, knots: jax.Array) -> list[tuple[jax.Array, jax.Array]]:
    if len(knots) == 1:
        return [(jnp.zeros(value.shape, jnp.int32), jnp.ones_like(value))]
    inner = jnp.expand_dims(knots[1:-1], tuple(range(value.ndim)))
    below = jnp.sum(inner < value[..., None], axis=-1, dtype=jnp.int32)
    low, high = _at(knots, below), _at(knots, below + 1)
    share = jnp.clip((value - low) / (high - low), 0.0, 1.0)
    return [(below, 1.0 - share), (below + 1, share)]


def _at(table: jax.Array, *index: jax.Array | int) -> jax.Array:
    """table[index], where the caller knows that the index is inside."""
    return table.at[index].get(mode="promise_in_bounds")


def cell(size: tuple[int, ...], point: Point) -> Cell:
    """The cell that a point falls in, for tables of `size` (H, W); points outside the square move to its edge."""
    x, y = (jnp.clip(p, 0.0, 1.0) * (n - 1) for p, n in zip(point, reversed(size), strict=True))
    column = jnp.minimum(x.astype(jnp.int32), size[1] - 2)
    row = jnp.minimum(y.astype(jnp.int32), max(size[0] - 2, 0))
    return Cell(column, row, x - column, y - row)


def lerp(a: jax.Array, b: jax.Array, share: jax.Array) -> jax.Array:
    """a at share 0, b at share 1."""
    return a + (b - a) * share


def interpolate(table: jax.Array, where: Slices, point: Point) -> jax.Array:
    """Value of a table `(S, H, W, C)` at a point, `(..., C)`; a table of one row does not depend on y."""
    height, width = table.shape[1:3]
    at = cell((height, width), point)
    places = _along_y(height, width, where, at) if height > 1 else _at_row(height * width, where, at.column)
    corners = [(i + k, w * u) for i, w in places for k, u in ((0, 1.0 - at.x), (1, at.x))]
    return _weighted(table.reshape(-1, table.shape[3]), corners)


def density(tables: Warp, where: Slices, point: Point) -> jax.Array:
    """The density at a point of the square, `(...)`."""
    at = cell(tables.cells.shape[1:3], point)
    edges = _edges(tables, where, at)
    return lerp(edges[..., 0], edges[..., 1], at.x)


def _at_row(stride: int, where: Slices, first: jax.Array) -> Places:
    """The entry `first` of each slice, where slices lie `stride` apart, with the slices' weights."""
    return [(s * stride + first, w) for s, w in zip(where.index, where.weight, strict=True)]


def _along_y(height: int, width: int, where: Slices, at: Cell) -> Places:
    """The entries on the left edge of a cell, in each slice, with their weights."""
    first = _at_row(height * width, where, at.row * width + at.column)
    return [(i + j * width, w * v) for i, w in first for j, v in ((0, 1.0 - at.y), (1, at.y))]


def _weighted(flat: jax.Array, places: Places) -> jax.Array:
    """The weighted sum of the entries of a table `(N, C)`, `(..., C)`."""
    return sum((_at(flat, i) * w[..., None] for i, w in places), start=jnp.zeros(()))


def _weighted_number(flat: jax.Array, number: int, places: Places) -> jax.Array:
    """One of the C numbers of `_weighted`, `(...)`."""
    values = flat.reshape(-1)
    return sum((_at(values, flat.shape[1] * i + number) * w for i, w in places), start=jnp.zeros(()))


def _edges(tables: Warp, where: Slices, at: Cell) -> jax.Array:
    """At the cell's y, `(..., 3)`: the density on its left and right edge, and the integral over x up to the left."""
    height, width = tables.cells.shape[1:3]
    return _weighted(tables.cells.reshape(-1, 3), _along_y(height, width, where, at))


def _left_integral(tables: Warp, where: Slices, at: Cell) -> jax.Array:
    """The last number of `_edges` alone."""
    height, width = tables.cells.shape[1:3]
    return _weighted_number(tables.cells.reshape(-1, 3), 2, _along_y(height, width, where, at))


def _row(tables: Warp, where: Slices, row: jax.Array) -> jax.Array:
    """The row's entry of `Warp.rows` between the slices, `(..., 3)`."""
    return _weighted(tables.rows.reshape(-1, 3), _at_row(tables.rows.shape[1], where, row))


def _row_start(tables: Warp, where: Slices, row: jax.Array) -> jax.Array:
    """The first number of `_row` alone."""
    return _weighted_number(tables.rows.reshape(-1, 3), 0, _at_row(tables.rows.shape[1], where, row))


def invert(tables: Warp, where: Slices, point: Point) -> tuple[Point, jax.Array]:
    """The uniform point that `sample` takes to `point`, and the density there, `(...)`."""
    height, width = tables.cells.shape[1:3]
    at = cell((height, width), point)
    edges, row = _edges(tables, where, at), _row(tables, where, at.row)
    left, right, start = edges[..., 0], edges[..., 1], edges[..., 2]
    before, low, high = row[..., 0], row[..., 1], row[..., 2]
    x = start + _segment_integral(left, right, at.x) / (width - 1)
    y = before + _segment_integral(low, high, at.y) / (height - 1)
    return Point(safe_divide(x, lerp(low, high, at.y)), y), lerp(left, right, at.x)


def sample(tables: Warp, where: Slices, uniform: Point) -> tuple[Point, jax.Array]:
    """The point that two uniform numbers are warped to, and the density there, `(...)`."""
    height, width = tables.cells.shape[1:3]
    x, y = (jnp.clip(u, 0.0, ONE_MINUS) for u in uniform)
    index = _last_below(lambda i: _row_start(tables, where, i), y, height)
    row = _row(tables, where, index)
    before, low, high = row[..., 0], row[..., 1], row[..., 2]
    down = _invert_segment(low, high, (y - before) * (height - 1))
    x = x * lerp(low, high, down)
    x, at = staged((x, Cell(jnp.zeros_like(index), index, x, down)))
    column = _last_below(lambda i: _left_integral(tables, where, at._replace(column=i)), x, width)
    edges = _edges(tables, where, at._replace(column=column))
    left, right, start = edges[..., 0], edges[..., 1], edges[..., 2]
    over = _invert_segment(left, right, (x - start) * (width - 1))
    return Point((column + over) / (width - 1), (index + down) / (height - 1)), lerp(left, right, over)


def _segment_integral(a: jax.Array, b: jax.Array, share: jax.Array) -> jax.Array:
    """Integral from 0 to `share` of the density that runs linearly from a to b on [0, 1]."""
    return share * lerp(a, b, 0.5 * share)


def _invert_segment(a: jax.Array, b: jax.Array, integral: jax.Array) -> jax.Array:
    """Inverse of `_segment_integral` in its last argument, in [0, 1]."""
    flat = jnp.abs(a - b) <= NEARLY_FLAT * (a + b)
    root = safe_sqrt(a * a + 2.0 * integral * (b - a))
    share = jnp.where(flat, safe_divide(2.0 * integral, a + b), safe_divide(a - root, a - b))
    return jnp.clip(share, 0.0, 1.0)


def _last_below(value_at: Callable[[jax.Array], jax.Array], target: jax.Array, count: int) -> jax.Array:
    """The last i in [0, count - 2] with value_at(i) < target, or 0, by bisection; `value_at` does not decrease."""

    def halve(_: int, ends: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        low, high = ends
        middle = (low + high) // 2
        below = value_at(middle) < target
        return jnp.where(below, middle, low), jnp.where(below, high, middle)

    # A loop rather than its unrolled steps, which XLA would fuse and so compute again and again.
    start = jnp.zeros(target.shape, jnp.int32), jnp.full(target.shape, count - 1, jnp.int32)
    return jax.lax.fori_loop(0, max(count - 2, 1).bit_length(), halve, start)[0]
