"""Densities on the unit square given as tables that depend on two parameters: value, warp from uniform and its inverse.

The tables are bilinear inside a slice and linear between slices, after the supplement of Dupuy and Jakob (2018). A point is
`(..., 2)` as (x, y): x runs along a table's last axis, y along the one before. P slices lie along the first parameter
(azimuth), T along the second (elevation).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.numerics import safe_divide, safe_sqrt

ONE_MINUS = float(np.nextafter(np.float32(1.0), np.float32(0.0)))
"""The largest float32 below 1: a uniform of exactly 1 would fall off the last cell."""

NEARLY_FLAT = 1e-4
"""Relative difference of a segment's ends below which its density counts as constant when it is inverted.

The quadratic's rounding error grows as eps/d, the error of the constant as d; they meet near sqrt(6e-8) = 2.4e-4 in float32.
Mitsuba's `Marginal2D` uses 1e-4, too.
"""


class Slices(NamedTuple):
    """Which slices a query falls between, and their weights: up to four pairs of `(...)` arrays."""

    index: tuple[jax.Array, ...]
    weight: tuple[jax.Array, ...]


class Warp(NamedTuple):
    """A density with its integrals, each slice normalised to one.

    Attributes:
        density: values at the table's nodes, `(S, H, W)`.
        across: integral over x from 0 to the node, at each node's y, `(S, H, W)`.
        along: integral over y (and all x) from 0 to the row, `(S, H)`.
    """

    density: jax.Array
    across: jax.Array
    along: jax.Array


class Cell(NamedTuple):
    """A table's cell, by its lower corner (integers), and the place within it in [0, 1]."""

    column: jax.Array
    row: jax.Array
    x: jax.Array
    y: jax.Array


def warp(density: np.ndarray) -> Warp:
    """The normalised density and its integrals, of a non-negative table `(S, H, W)`; in float64, kept in float32."""
    values = np.asarray(density, np.float64)
    across = _cumulative(values) / (values.shape[2] - 1)
    along = _cumulative(across[:, :, -1]) / (values.shape[1] - 1)
    total = along[:, -1]
    tables = values / total[:, None, None], across / total[:, None, None], along / total[:, None]
    return Warp(*(jnp.asarray(table, jnp.float32) for table in tables))


def _cumulative(values: np.ndarray) -> np.ndarray:
    """Trapezoidal integral over the last axis from its start, for a spacing of one."""
    sums = np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1)
    return np.concatenate([np.zeros_like(values[..., :1]), sums], axis=-1)


def slices(first: jax.Array, second: jax.Array, knots: tuple[jax.Array, jax.Array]) -> Slices:
    """The slices around parameters `first` and `second`, `(...)`, for their increasing knots `(P,)` and `(T,)`.

    Parameters outside the knots take the end's value. A parameter with one knot adds no slice to look up.
    """
    along_first, along_second = _bracket(first, knots[0]), _bracket(second, knots[1])
    pairs = [(p * len(knots[1]) + t, a * b) for p, a in along_first for t, b in along_second]
    return Slices(tuple(i for i, _ in pairs), tuple(w for _, w in pairs))


def _bracket(value: jax.Array, knots: jax.Array) -> list[tuple[jax.Array, jax.Array]]:
    if len(knots) == 1:
        return [(jnp.zeros(value.shape, jnp.int32), jnp.ones_like(value))]
    inner = jnp.expand_dims(knots[1:-1], tuple(range(value.ndim)))
    below = jnp.sum(inner < value[..., None], axis=-1, dtype=jnp.int32)
    low, high = _at(knots, below), _at(knots, below + 1)
    share = jnp.clip((value - low) / (high - low), 0.0, 1.0)
    return [(below, 1.0 - share), (below + 1, share)]


def _at(table: jax.Array, *index: jax.Array) -> jax.Array:
    """table[index], where the caller knows that the index is inside."""
    return table.at[index].get(mode="promise_in_bounds")


def blend(table: jax.Array, where: Slices, *index: jax.Array) -> jax.Array:
    """The table's entry at `index`, interpolated between slices; further axes of the table are kept."""
    values = [_at(table, s, *index) for s in where.index]
    extra = tuple(range(where.weight[0].ndim, values[0].ndim))
    return sum(v * jnp.expand_dims(w, extra) for v, w in zip(values, where.weight, strict=True))


def cell(size: tuple[int, int], point: jax.Array) -> Cell:
    """The cell that a point falls in, for tables of `size` (H, W); points outside the square move to its edge."""
    x, y = (jnp.clip(point[..., i], 0.0, 1.0) * (n - 1) for i, n in ((0, size[1]), (1, size[0])))
    column = jnp.minimum(x.astype(jnp.int32), size[1] - 2)
    row = jnp.minimum(y.astype(jnp.int32), size[0] - 2)
    return Cell(column, row, x - column, y - row)


def lerp(a: jax.Array, b: jax.Array, share: jax.Array) -> jax.Array:
    """a at share 0, b at share 1."""
    return a + (b - a) * share


def interpolate(table: jax.Array, where: Slices, point: jax.Array) -> jax.Array:
    """Value of a table `(S, H, W)` or `(S, H, W, C)` at a point, `(...)` or `(..., C)`."""
    at = cell(table.shape[1:3], point)
    left, right = _edges(table, where, at)
    extra = tuple(range(at.x.ndim, left.ndim))
    return lerp(left, right, jnp.expand_dims(at.x, extra))


def _edges(table: jax.Array, where: Slices, at: Cell) -> tuple[jax.Array, jax.Array]:
    """Values on the cell's left and right edge at the cell's y."""
    corner = [blend(table, where, at.row + j, at.column + i) for i in (0, 1) for j in (0, 1)]
    share = jnp.expand_dims(at.y, tuple(range(at.y.ndim, corner[0].ndim)))
    return lerp(corner[0], corner[1], share), lerp(corner[2], corner[3], share)


def invert(tables: Warp, where: Slices, point: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The uniform point that `sample` takes to `point`, `(..., 2)`, and the density there, `(...)`."""
    height, width = tables.density.shape[1:]
    at = cell((height, width), point)
    left, right = _edges(tables.density, where, at)
    start, _ = _edges(tables.across, where, at)
    low, high = _row_integrals(tables, where, at.row)
    x = start + _segment_integral(left, right, at.x) / (width - 1)
    y = blend(tables.along, where, at.row) + _segment_integral(low, high, at.y) / (height - 1)
    uniform = jnp.stack([safe_divide(x, lerp(low, high, at.y)), y], axis=-1)
    return uniform, lerp(left, right, at.x)


def sample(tables: Warp, where: Slices, uniform: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The point that a uniform `(..., 2)` is warped to, `(..., 2)`, and the density there, `(...)`."""
    height, width = tables.density.shape[1:]
    x, y = (jnp.clip(uniform[..., i], 0.0, ONE_MINUS) for i in (0, 1))
    row = _last_below(lambda i: blend(tables.along, where, i), y, height)
    low, high = _row_integrals(tables, where, row)
    within = (y - blend(tables.along, where, row)) * (height - 1)
    down = _invert_segment(low, high, within)

    def across(column: jax.Array) -> jax.Array:
        return lerp(blend(tables.across, where, row, column), blend(tables.across, where, row + 1, column), down)

    x = x * lerp(low, high, down)
    column = _last_below(across, x, width)
    left, right = _edges(tables.density, where, Cell(column, row, x, down))
    over = _invert_segment(left, right, (x - across(column)) * (width - 1))
    point = jnp.stack([(column + over) / (width - 1), (row + down) / (height - 1)], axis=-1)
    return point, lerp(left, right, over)


def _row_integrals(tables: Warp, where: Slices, row: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Integrals over all x at the row's lower and upper edge."""
    last = jnp.full(row.shape, tables.across.shape[2] - 1, jnp.int32)
    return blend(tables.across, where, row, last), blend(tables.across, where, row + 1, last)


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
    """Bisection for the last i in [0, count - 2] with value_at(i) < target, or 0; `value_at` does not decrease."""
    low = jnp.zeros(target.shape, jnp.int32)
    high = jnp.full(target.shape, count - 1, jnp.int32)
    for _ in range(max(count - 2, 1).bit_length()):
        middle = (low + high) // 2
        below = (value_at(middle) < target) & (middle > low)
        low, high = jnp.where(below, middle, low), jnp.where(below, high, middle)
    return low
