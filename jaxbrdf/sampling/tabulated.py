"""A piecewise constant density on the unit square, such as an environment map's brightness."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np


class Tabulated(NamedTuple):
    """Distribution functions of H rows and, within each, of W columns; of one density or a stack of them.

    Attributes:
        rows: `(..., H + 1)`, rising from 0 to 1.
        columns: `(..., H, W + 1)`, each row rising from 0 to 1.
    """

    rows: jax.Array
    columns: jax.Array


class Draw(NamedTuple):
    """A point of the unit square `(..., 2)` as (u along the columns, v along the rows), and its density `(...)`."""

    point: jax.Array
    density: jax.Array


def tabulate(weights: np.ndarray) -> Tabulated:
    """The density proportional to `weights`, `(..., H, W)`, non-negative, none of the stack all zero.

    Sums are taken in float64. The density is later read from the rounded sums themselves, so that it is exactly what
    the sampler does.

    Raises:
        ValueError: weights of the wrong rank, negative, not finite, or all zero.
    """
    weights = np.asarray(weights)
    if weights.ndim < 2 or weights.size == 0:
        raise ValueError(f"weights has shape {weights.shape}; it must be (..., H, W)")
    if not np.all(np.isfinite(weights)) or np.any(weights < 0):
        raise ValueError("weights has negative or non-finite entries; they must be finite and at least zero")
    if not weights.any((-2, -1)).all():
        raise ValueError("weights is zero everywhere; at least one entry must be positive")
    rows = _distribution(weights.sum(-1, dtype=np.float64))
    return Tabulated(jnp.asarray(rows, jnp.float32), jnp.asarray(_distribution(weights), jnp.float32))


def _distribution(weights: np.ndarray) -> np.ndarray:
    """Normalised running sum over the last axis with a leading zero; uniform where there is nothing to normalise."""
    total = np.cumsum(weights, axis=-1, dtype=np.float64)
    total = np.concatenate([np.zeros_like(total[..., :1]), total], axis=-1)
    last = total[..., -1:]
    return np.where(last > 0, total / np.where(last > 0, last, 1.0), np.linspace(0.0, 1.0, total.shape[-1]))


def sample_tabulated(table: Tabulated, u: jax.Array, *, at: tuple[jax.Array, ...] = ()) -> Draw:
    """A point drawn from the density by inversion: u[1] picks the row, u[0] the column, `(..., 2)`.

    Args:
        table: one density, or a stack.
        u: uniform in [0, 1).
        at: indices `(...)` into the stack, one for each of its axes.
    """
    height, width = _size(table)
    row = _find(lambda i: table.rows[(*at, i)], height, u[..., 1])
    column = _find(lambda i: table.columns[(*at, row, i)], width, u[..., 0])
    v, row_mass = _place(table.rows[(*at, row)], table.rows[(*at, row + 1)], u[..., 1])
    start, end = table.columns[(*at, row, column)], table.columns[(*at, row, column + 1)]
    x, column_mass = _place(start, end, u[..., 0])
    point = jnp.stack([(column + x) / width, (row + v) / height], axis=-1)
    return Draw(point, row_mass * column_mass * (height * width))


def tabulated_density(table: Tabulated, point: jax.Array, *, at: tuple[jax.Array, ...] = ()) -> jax.Array:
    """Density at a point `(..., 2)` of the unit square, of the stack's `at`, as for `sample_tabulated`."""
    height, width = _size(table)
    row, column = _cell(table, point)
    row_mass = table.rows[(*at, row + 1)] - table.rows[(*at, row)]
    column_mass = table.columns[(*at, row, column + 1)] - table.columns[(*at, row, column)]
    return row_mass * column_mass * (height * width)


def tabulated_to_square(table: Tabulated, point: jax.Array, *, at: tuple[jax.Array, ...] = ()) -> jax.Array:
    """The u that `sample_tabulated` turns into `point`, where its cell has mass."""
    height, width = _size(table)
    row, column = _cell(table, point)
    start, end = table.columns[(*at, row, column)], table.columns[(*at, row, column + 1)]
    u = start + (point[..., 0] * width - column) * (end - start)
    start, end = table.rows[(*at, row)], table.rows[(*at, row + 1)]
    return jnp.stack([u, start + (point[..., 1] * height - row) * (end - start)], axis=-1)


def _size(table: Tabulated) -> tuple[int, int]:
    return table.columns.shape[-2], table.columns.shape[-1] - 1


def _cell(table: Tabulated, point: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Row and column of the cell that a point `(..., 2)` falls in."""
    height, width = _size(table)
    row = jnp.clip((point[..., 1] * height).astype(jnp.int32), 0, height - 1)
    return row, jnp.clip((point[..., 0] * width).astype(jnp.int32), 0, width - 1)


def _find(lower, count: int, u: jax.Array) -> jax.Array:
    """The last i in [0, count) with lower(i) <= u, by bisection; `lower` must not fall and start at zero."""

    def halve(_: int, bounds: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        low, high = bounds
        middle = (low + high) // 2
        below = lower(middle) <= u
        return jnp.where(below, middle, low), jnp.where(below, high, middle)

    bounds = (jnp.zeros(u.shape, jnp.int32), jnp.full(u.shape, count, jnp.int32))
    return jax.lax.fori_loop(0, max(count - 1, 1).bit_length(), halve, bounds)[0]


def _place(start: jax.Array, end: jax.Array, u: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Where u lies between the two sums, in [0, 1], and the mass between them."""
    mass = end - start
    return jnp.clip((u - start) / jnp.where(mass > 0, mass, 1.0), 0.0, 1.0), mass
