"""Textures over directions, in polar coordinates of the unit disk (Timonen et al., section 3).

A texture is `(channels, n_r, n_phi)`. Row i stands at radius i / (n_r - 1): the first row is the disk's centre, the
last its rim. Column j stands at the fraction j / n_phi of the azimuth's period, and the columns wrap. The centre is one
point: its row holds one value for all azimuths (`close_centre`). A texture of one column has no azimuth at all.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_atan2, safe_sqrt
from jaxbrdf.core.staging import staged

LANES = 8
"""Texels are added in rows of whole vectors: eight floats fill one of AVX2's, and divide AVX-512's."""


class Polar(NamedTuple):
    """A direction's place on the unit disk.

    Attributes:
        r: length of its projection, in [0, 1], `(...)`.
        turn: azimuth over its period, in [0, 1), `(...)`; None where there is no azimuth.
    """

    r: jax.Array
    turn: jax.Array | None


class Cell(NamedTuple):
    """The texels around a batch of places: flat index of the nearest one to the origin, and the fractions beyond it."""

    index: jax.Array
    along_r: jax.Array
    along_phi: jax.Array | None


def is_texture(leaf: jax.Array) -> bool:
    """Whether an array among a model's parameters is an angular texture: no other parameter has rank 3."""
    return leaf.ndim == 3


def polar(w: jax.Array, period: float | None) -> Polar:
    """Polar coordinates of w on the disk, its azimuth wrapped to `period` radians (None: no azimuth)."""
    return polar_of(w[..., 0], w[..., 1], period)


def polar_of(x: jax.Array, y: jax.Array, period: float | None) -> Polar:
    """`polar` of a direction's x and y, `(...)` each; where their squares underflow it is the centre, azimuth zero."""
    r = jnp.minimum(safe_sqrt(x * x + y * y), 1.0)
    if period is None:
        return Polar(r, None)
    # the angle's derivative divides by the same squares
    turn = safe_atan2(jnp.where(r > 0, y, 0.0), jnp.where(r > 0, x, 1.0)) / period
    turn = turn - jnp.floor(turn)
    return Polar(r, jnp.where(turn < 1.0, turn, 0.0))


def close_centre(texture: jax.Array) -> jax.Array:
    """The texture with its first row made one value, the first texel's, so that the disk's centre is single-valued."""
    row = jnp.broadcast_to(texture[:, :1, :1], (texture.shape[0], 1, texture.shape[2]))
    return jnp.concatenate([row, texture[:, 1:]], axis=1)


def fetch(texture: jax.Array, at: Polar) -> jax.Array:
    """Bilinear lookup, `(channels, batch)`, at coordinates of shape `(batch,)`.

    Differentiable in the texture and both coordinates; what a caller does not differentiate is not compiled.
    """
    return _fetch(texture, at.r, at.turn)


@jax.custom_vjp
def _fetch(texture: jax.Array, r: jax.Array, turn: jax.Array | None) -> jax.Array:
    return _fetch_forward(texture, r, turn)[0]


def _fetch_forward(texture: jax.Array, r: jax.Array, turn: jax.Array | None):
    cell = cell_of(texture.shape, r, turn)
    near, far = _edges(texture, cell)
    slope = far.value - near.value
    across = (
        None if near.slope is None or far.slope is None else near.slope + (far.slope - near.slope) * cell.along_r[None]
    )
    return near.value + slope * cell.along_r[None], (texture.shape, cell, slope, across)


def _fetch_backward(saved: tuple[tuple[int, int, int], Cell, jax.Array, jax.Array | None], g: jax.Array):
    """The transpose of the lookup, written out: derived automatically it scatters the corners one channel at a time."""
    shape, cell, slope, across = saved
    r = jnp.sum(g * slope, axis=0) * (shape[1] - 1)
    turn = None if across is None else jnp.sum(g * across, axis=0) * shape[2]
    return _scatter(shape, cell, g), r, turn


def cell_of(shape: tuple[int, ...], r: jax.Array, turn: jax.Array | None) -> Cell:
    """Cells of a texture whose first column stands again after its last, staged: a dozen loops read them."""
    _, n_r, n_phi = shape
    x = jnp.clip(r, 0.0, 1.0) * (n_r - 1)
    i = jnp.minimum(x.astype(jnp.int32), n_r - 2)
    if turn is None:
        return staged((x, Cell(i * (n_phi + 1), x - i, None)))[1]
    y = turn * n_phi
    j = jnp.minimum(y.astype(jnp.int32), n_phi - 1)
    return staged((x, Cell(i * (n_phi + 1) + j, x - i, y - j)))[1]


def corners_of(n_phi: int, cell: Cell) -> tuple[tuple[int, jax.Array], ...]:
    """Of each corner of a cell, the azimuth first, the flat distance from the cell's index and the bilinear weight."""
    r, phi = cell.along_r, cell.along_phi
    if phi is None:
        return (0, 1 - r), (n_phi + 1, r)
    return (0, (1 - r) * (1 - phi)), (1, (1 - r) * phi), (n_phi + 1, r * (1 - phi)), (n_phi + 2, r * phi)


def as_rows(texture: jax.Array) -> jax.Array:
    """Texels as rows `(n_r (n_phi + 1), channels)`, the first column again after the last: what cells count in."""
    return jnp.concatenate([texture, texture[:, :, :1]], axis=2).reshape(texture.shape[0], -1).T


def from_rows(shape: tuple[int, ...], rows: jax.Array) -> jax.Array:
    """The transpose of `as_rows`: the repeated column is added to the first."""
    channels, n_r, n_phi = shape
    columns = rows.T.reshape(channels, n_r, n_phi + 1)
    return columns[:, :, :n_phi].at[:, :, 0].add(columns[:, :, n_phi])


class Edge(NamedTuple):
    """Values at one radius, interpolated over the azimuth, and their slope over it, each `(channels, batch)`."""

    value: jax.Array
    slope: jax.Array | None


def _edges(texture: jax.Array, cell: Cell) -> tuple[Edge, Edge]:
    """The near and the far radius.

    The corners of every cell are laid side by side first, so that a lookup is one run of memory: a batch then takes a
    third of the time of gathering each corner of each channel.
    """
    texels, offsets = as_rows(texture), [offset for offset, _ in corners_of(texture.shape[2], cell)]
    table = jnp.concatenate([jnp.roll(texels, -o, axis=0) for o in offsets], axis=1)
    rows = table.at[cell.index].get(mode="promise_in_bounds")
    corners = jnp.split(rows.T, len(offsets))
    if cell.along_phi is None:
        return Edge(corners[0], None), Edge(corners[1], None)
    return _between(*corners[:2], along=cell.along_phi), _between(*corners[2:], along=cell.along_phi)


def _between(left: jax.Array, right: jax.Array, *, along: jax.Array) -> Edge:
    slope = right - left
    return Edge(left + slope * along[None], slope)


def _scatter(shape: tuple[int, ...], cell: Cell, g: jax.Array) -> jax.Array:
    channels, n_r, n_phi = shape
    padding = -channels % LANES
    rows = jnp.pad(g, ((0, padding), (0, 0))).T
    texels = jnp.zeros((n_r * (n_phi + 1), channels + padding), g.dtype)
    for offset, weight in corners_of(n_phi, cell):
        texels = texels.at[cell.index + offset].add(rows * weight[:, None], mode="promise_in_bounds")
    return from_rows(shape, texels[:, :channels])


_fetch.defvjp(_fetch_forward, _fetch_backward)
