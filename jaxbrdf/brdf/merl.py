"""MERL tables (Matusik et al. 2003) as a BRDF: looked up by the nearest cell or trilinearly."""

from __future__ import annotations

from functools import cache, partial
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.cosine_sampler import cosine_sampled
from jaxbrdf.core.arctangent import fast_atan2
from jaxbrdf.core.directions import above_horizon, half_difference, sin_theta
from jaxbrdf.core.numerics import safe_divide, safe_sqrt
from jaxbrdf.core.staging import staged
from jaxbrdf.data.merl import SHAPE, Merl
from jaxbrdf.types import Brdf, Material, Query

Lookup = Literal["nearest", "trilinear"]


class MerlParams(NamedTuple):
    """Attributes:
    cells: red, green, blue (zero where invalid) and 1 or 0 for valid or not, `(90, 90, 180, 4)`.
    """

    cells: jax.Array


class Place(NamedTuple):
    """Coordinates in units of cells, `(...)` each: cell i covers i to i + 1."""

    theta_h: jax.Array
    theta_d: jax.Array
    phi_d: jax.Array


def params(table: Merl) -> MerlParams:
    """The table in float32, the validity as a fourth channel so that both are read at once."""
    cells = np.concatenate([table.rgb, table.valid[..., None]], axis=-1)
    return MerlParams(jnp.asarray(cells, jnp.float32))


@cache
def brdf(lookup: Lookup) -> Brdf:
    """The pure functions for one kind of lookup, the same ones each time; light is drawn by cosine.

    Raises:
        ValueError: if there is no such lookup.
    """
    functions = {"nearest": _nearest, "trilinear": _trilinear}
    if lookup not in functions:
        raise ValueError(f"lookup is {lookup!r}; should be one of {sorted(functions)}")
    return cosine_sampled(partial(_evaluate, functions[lookup]))


def material(table: Merl, name: str, *, lookup: Lookup = "trilinear") -> Material:
    """A table as a material."""
    return Material(name, brdf(lookup), params(table), True)


def place(query: Query) -> Place:
    """Where a pair of directions lies in the table.

    theta_h is spaced as its square root, which makes the highlight's cells narrow: (i / 90)^2 pi/2.
    """
    half, difference = half_difference(query.wi, query.wo)
    theta_h = fast_atan2(sin_theta(half), half[..., 2])
    theta_d = fast_atan2(sin_theta(difference), difference[..., 2])
    phi_d = fast_atan2(difference[..., 1], difference[..., 0])
    turn = jnp.where(phi_d < 0, phi_d + jnp.pi, phi_d)
    return Place(
        safe_sqrt(theta_h * (2.0 / jnp.pi)) * SHAPE[0],
        theta_d * (2.0 / jnp.pi) * SHAPE[1],
        turn * (1.0 / jnp.pi) * SHAPE[2],
    )


def _evaluate(look_up, tables: MerlParams, query: Query) -> jax.Array:
    """f(wi, wo), `(..., 3)` in 1/sr; zero below the horizon and where no valid cell is near."""
    f = look_up(tables, staged(place(query)))
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _nearest(tables: MerlParams, where: Place) -> jax.Array:
    """The cell that the query falls in; zero if that is invalid."""
    row, column = (_clipped(x, n) for x, n in zip(where[:2], SHAPE[:2], strict=True))
    return _at(tables, row, column, where.phi_d.astype(jnp.int32) % SHAPE[2])[..., :3]


def _trilinear(tables: MerlParams, where: Place) -> jax.Array:
    """Between the centres of eight cells; invalid ones are left out and the others' weights add up to one again."""
    (h, h_share), (d, d_share), (p, p_share) = (_between_centres(x) for x in where)
    total = jnp.zeros(())
    for i, wh in ((0, 1.0 - h_share), (1, h_share)):
        for j, wd in ((0, 1.0 - d_share), (1, d_share)):
            for k, wp in ((0, 1.0 - p_share), (1, p_share)):
                row, column = jnp.clip(h + i, 0, SHAPE[0] - 1), jnp.clip(d + j, 0, SHAPE[1] - 1)
                total = total + _at(tables, row, column, (p + k) % SHAPE[2]) * (wh * wd * wp)[..., None]
    return safe_divide(total[..., :3], total[..., 3:])


def _between_centres(x: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The cell whose centre lies just below x (-1 before the first), and x's share of the way to the next centre."""
    below = jnp.floor(x - 0.5)
    return below.astype(jnp.int32), x - 0.5 - below


def _clipped(x: jax.Array, count: int) -> jax.Array:
    return jnp.clip(x.astype(jnp.int32), 0, count - 1)


def _at(tables: MerlParams, row: jax.Array, column: jax.Array, turn: jax.Array) -> jax.Array:
    index = (row * SHAPE[1] + column) * SHAPE[2] + turn
    return tables.cells.reshape(-1, 4).at[index].get(mode="promise_in_bounds")
