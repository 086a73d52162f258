"""Light drawn from tables of any reflectance, one for each of many views (the role of Lawrence et al. 2004).

Views lie on a grid of elevations and, where the material is anisotropic, azimuths. Each has a piecewise constant
density of wi over cells of equal steps in elevation and in azimuth, counted from the viewer's; within a cell it is
constant per solid angle. A view between the grid's draws from one of its neighbours by chance, with the weights of a
linear interpolation: the density is that mixture, continuous in wo.

A share of the draws is cosine-distributed (`jaxbrdf.sampling.defensive`).

Of an isotropic material both sides of the plane of view are usually alike, and one table serves them: 90 views of 90 by
180 cells, a degree each, are 5.9 MB (5.62 MiB, the size that De Oliveira et al. state).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.colour import luminance
from jaxbrdf.core.directions import above_horizon, azimuth, cos_theta, sin_theta, spherical
from jaxbrdf.core.numerics import safe_atan2, safe_sqrt
from jaxbrdf.sampling.defensive import defensive
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.sampling.tabulated import Tabulated, sample_tabulated, tabulate, tabulated_density
from jaxbrdf.sampling.view_frame import from_view, to_view
from jaxbrdf.types import Params, Query


@dataclass(frozen=True)
class ViewGrid:
    """The views and the cells of each view's table.

    Attributes:
        elevations: of the viewer, at k pi / (2 elevations) for k = 0 ... elevations - 1.
        azimuths: of the viewer, equal steps from zero; 1 for an isotropic material.
        rows: cells from the normal to the horizon.
        columns: cells about the normal, over half a turn if `mirrored`.
        mirrored: whether both sides of the plane of view share their mean.
    """

    elevations: int = 90
    azimuths: int = 1
    rows: int = 90
    columns: int = 180
    mirrored: bool = True


ISOTROPIC = ViewGrid()
"""A degree in each angle."""

ANISOTROPIC = ViewGrid(elevations=23, azimuths=24, rows=45, columns=90, mirrored=False)
"""Four degrees in elevation and azimuth of light, four in elevation of the viewer, 15 in its azimuth: 9.1 MB."""


class Neighbours(NamedTuple):
    """Indices `(n, ...)` of a view's neighbours in the grid and their weights, of sum one."""

    index: jax.Array
    weight: jax.Array


def conditional(grid: ViewGrid) -> Proposal:
    """The proposal whose parameters are those of `tabulate_conditional`."""
    return defensive(Proposal(partial(_sample, grid), partial(_pdf, grid)))


def tabulate_conditional(
    grid: ViewGrid, evaluate: Callable[[Params, Query], jax.Array], params: Params, *, points: int = 1
) -> Tabulated:
    """The tables of each view's luminance of f cos(wi), `(elevations azimuths, rows, columns)`.

    Args:
        grid: views and cells.
        evaluate: `(params, query) -> f`.
        params: what it takes first.
        points: of f along each side of a cell, whose mean counts.

    Raises:
        ValueError: f is somewhere not finite.
    """
    weights = np.array(_weights(grid, evaluate, params, points))
    # where nothing is reflected any density will do
    weights[~weights.any((-2, -1))] = 1.0
    return tabulate(weights)


def memory(params: Params) -> int:
    """Bytes of a proposal's parameters."""
    return sum(leaf.nbytes for leaf in jax.tree.leaves(params))


def place(grid: ViewGrid, point: jax.Array, side: jax.Array) -> jax.Array:
    """Direction `(..., 3)` at a point `(..., 2)` of a table, in the frame in which the viewer's azimuth is zero.

    Rows are equal steps of elevation; within each, 1 - cos is linear, so that solid angle is. `side`, 1 or -1, tells
    which side of the plane of view is meant where one table serves both.
    """
    row = jnp.minimum(jnp.floor(point[..., 1] * grid.rows), grid.rows - 1)
    low, high = _row_edges(grid, row)
    t = low + (point[..., 1] * grid.rows - row) * (high - low)
    phi = side * point[..., 0] * jnp.pi if grid.mirrored else (2.0 * point[..., 0] - 1.0) * jnp.pi
    sine = safe_sqrt(t * (2.0 - t))
    return jnp.stack([sine * jnp.cos(phi), sine * jnp.sin(phi), 1.0 - t], axis=-1)


def locate(grid: ViewGrid, w: jax.Array) -> jax.Array:
    """The point `(..., 2)` of a table that stands for a direction above the horizon; inverse of `place`."""
    sine = sin_theta(w)
    elevation = safe_atan2(sine, cos_theta(w)) * (2.0 / jnp.pi)
    row = jnp.clip(jnp.floor(elevation * grid.rows), 0, grid.rows - 1)
    low, high = _row_edges(grid, row)
    t = sine * sine / (1.0 + jnp.maximum(cos_theta(w), 0.0))
    within = jnp.clip((t - low) / (high - low), 0.0, 1.0)
    phi = azimuth(w) / jnp.pi
    x = jnp.abs(phi) if grid.mirrored else 0.5 * (phi + 1.0)
    return jnp.stack([x, (row + within) / grid.rows], axis=-1)


def _sample(grid: ViewGrid, tables: Tabulated, wo: jax.Array, u: jax.Array) -> jax.Array:
    near = _neighbours(grid, wo)
    # the last neighbour whose interval u[0] reaches
    reached = jnp.cumsum(near.weight, axis=0) - near.weight <= u[None, ..., 0]
    last = jnp.sum(reached & (near.weight > 0), axis=0) - 1
    index = jnp.take_along_axis(near.index, last[None], axis=0)[0]
    column, side = _unfolded(u[..., 1]) if grid.mirrored else (u[..., 1], jnp.ones_like(u[..., 1]))
    point = sample_tabulated(tables, jnp.stack([column, u[..., 2]], axis=-1), at=(index,)).point
    return from_view(place(grid, point, side), wo)


def _pdf(grid: ViewGrid, tables: Tabulated, wi: jax.Array, wo: jax.Array) -> jax.Array:
    near = _neighbours(grid, wo)
    point = locate(grid, to_view(wi, wo))
    density = sum(w * tabulated_density(tables, point, at=(i,)) for i, w in zip(*near, strict=True))
    low, high = _row_edges(grid, jnp.clip(jnp.floor(point[..., 1] * grid.rows), 0, grid.rows - 1))
    solid_angle = 2.0 * jnp.pi * grid.rows * (high - low)
    return jnp.where(above_horizon(wi, wo), density / solid_angle, 0.0)


def _row_edges(grid: ViewGrid, row: jax.Array) -> tuple[jax.Array, jax.Array]:
    """1 - cos at both ends of a row, as 2 sin^2 of half the elevation."""
    step = 0.25 * jnp.pi / grid.rows
    return 2.0 * jnp.sin(row * step) ** 2, 2.0 * jnp.sin((row + 1.0) * step) ** 2


def _neighbours(grid: ViewGrid, wo: jax.Array) -> Neighbours:
    """The two elevations around the viewer's, at the last one that alone, times the two azimuths around it if any."""
    steps = safe_atan2(sin_theta(wo), jnp.maximum(cos_theta(wo), 0.0)) * (2.0 * grid.elevations / jnp.pi)
    pairs = _between(steps, grid.elevations, lambda k: jnp.minimum(k, grid.elevations - 1))
    if grid.azimuths > 1:
        turn = azimuth(wo) * (grid.azimuths / (2.0 * jnp.pi))
        turns = _between(turn, grid.azimuths, lambda k: jnp.mod(k, grid.azimuths))
        pairs = [(k * grid.azimuths + j, a * b) for k, a in pairs for j, b in turns]
    index, weight = zip(*pairs, strict=True)
    return Neighbours(jnp.stack(index), jnp.stack(weight))


def _between(
    steps: jax.Array, count: int, valid: Callable[[jax.Array], jax.Array]
) -> list[tuple[jax.Array, jax.Array]]:
    """The two nodes around a position in steps of the grid, put to `valid` indices, and their weights."""
    low = jnp.minimum(jnp.floor(steps), count - 1)
    share = jnp.clip(steps - low, 0.0, 1.0)
    index = low.astype(jnp.int32)
    return [(valid(index), 1.0 - share), (valid(index + 1), share)]


def _unfolded(u: jax.Array) -> tuple[jax.Array, jax.Array]:
    """A uniform number in [0, 1), and a side of the plane of view, of one uniform number."""
    both = 2.0 * u - 1.0
    below_one = 1.0 - jnp.finfo(u.dtype).epsneg
    return jnp.minimum(jnp.abs(both), below_one), jnp.where(both < 0, -1.0, 1.0).astype(u.dtype)


@partial(jax.jit, static_argnums=(0, 1, 3))
def _weights(grid: ViewGrid, evaluate: Callable[[Params, Query], jax.Array], params: Params, points: int) -> jax.Array:
    """Luminance of f cos(wi) times the cells' solid angle, summed over `points`^2 places, view by view."""
    sides = 2 if grid.mirrored else 1
    theta = (jnp.arange(grid.rows * points) + 0.5) * (0.5 * jnp.pi / (grid.rows * points))
    phi = ((jnp.arange(grid.columns * points) + 0.5) / (grid.columns * points) * 2.0 - 1.0) * jnp.pi
    phi = jnp.stack([0.5 * (phi + jnp.pi), -0.5 * (phi + jnp.pi)]) if grid.mirrored else phi[None]
    light = spherical(*jnp.broadcast_arrays(theta[None, :, None], phi[:, None, :]))
    solid_angle = (jnp.cos(theta) * jnp.sin(theta))[None, :, None]

    def of_view(view: jax.Array) -> jax.Array:
        elevation, turn = view
        wo = jnp.broadcast_to(spherical(elevation, turn), light.shape)
        # not by wo, which at the normal has no azimuth
        wi = from_view(light, jnp.broadcast_to(spherical(jnp.ones_like(turn), turn), light.shape))
        f = luminance(evaluate(params, Query(wi, wo)))
        value = jnp.maximum(f, 0.0) * solid_angle
        return value.reshape(sides, grid.rows, points, grid.columns, points).sum((0, 2, 4))

    elevation = jnp.arange(grid.elevations) * (0.5 * jnp.pi / grid.elevations)
    turn = jnp.arange(grid.azimuths) * (2.0 * jnp.pi / grid.azimuths)
    views = jnp.stack([a.ravel() for a in jnp.meshgrid(elevation, turn, indexing="ij")], axis=-1)
    return jax.lax.map(of_view, views)
