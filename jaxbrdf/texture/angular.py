"""Textures over directions, in polar coordinates of the unit disk (Timonen et al., section 3).

A texture is `(channels, n_r, n_phi)`. Row i stands at radius i / (n_r - 1): the first row is the disk's centre, the
last its rim. Column j stands at the fraction j / n_phi of the azimuth's period, and the columns wrap. The centre is one
point: its row holds one value for all azimuths (`close_centre`). A texture of one column has no azimuth at all.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import azimuth, sin_theta


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
    r = jnp.minimum(sin_theta(w), 1.0)
    if period is None:
        return Polar(r, None)
    turn = azimuth(w) / period
    turn = turn - jnp.floor(turn)
    return Polar(r, jnp.where(turn < 1.0, turn, 0.0))


def close_centre(texture: jax.Array) -> jax.Array:
    """The texture with its first row made one value, the first texel's, so that the disk's centre is single-valued."""
    row = jnp.broadcast_to(texture[:, :1, :1], (texture.shape[0], 1, texture.shape[2]))
    return jnp.concatenate([row, texture[:, 1:]], axis=1)


def fetch(texture: jax.Array, at: Polar) -> jax.Array:
    """Bilinear lookup, `(channels, batch)`, at coordinates of shape `(batch,)`.

    Differentiable in the texture and the radius; the azimuth, which no parameter moves, has gradient zero.
    """
    return _fetch(texture, at.r, at.turn)


@jax.custom_vjp
def _fetch(texture: jax.Array, r: jax.Array, turn: jax.Array | None) -> jax.Array:
    return _interpolate(texture, _cell(texture.shape, r, turn))


def _cell(shape: tuple[int, ...], r: jax.Array, turn: jax.Array | None) -> Cell:
    """Cells of a texture whose first column stands again after its last.

    The barrier makes them arrays: without it every channel's loop finds them anew.
    """
    _, n_r, n_phi = shape
    x = jnp.clip(r, 0.0, 1.0) * (n_r - 1)
    i = jnp.minimum(x.astype(jnp.int32), n_r - 2)
    if turn is None:
        return jax.lax.optimization_barrier(Cell(i * (n_phi + 1), x - i, None))
    y = turn * n_phi
    j = jnp.minimum(y.astype(jnp.int32), n_phi - 1)
    return jax.lax.optimization_barrier(Cell(i * (n_phi + 1) + j, x - i, y - j))


def _corners(texture: jax.Array, cell: Cell) -> tuple[jax.Array, jax.Array]:
    """Values at the near and the far radius, interpolated over the azimuth, each `(channels, batch)`."""
    channels, _, n_phi = texture.shape
    flat = jnp.concatenate([texture, texture[:, :, :1]], axis=2).reshape(channels, -1)

    def column(offset: int) -> jax.Array:
        return flat.at[:, cell.index + offset].get(mode="promise_in_bounds")

    if cell.along_phi is None:
        return column(0), column(n_phi + 1)
    phi = cell.along_phi[None]
    near, far = column(0), column(n_phi + 1)
    return near + (column(1) - near) * phi, far + (column(n_phi + 2) - far) * phi


def _interpolate(texture: jax.Array, cell: Cell) -> jax.Array:
    near, far = _corners(texture, cell)
    return near + (far - near) * cell.along_r[None]


def _fetch_forward(texture: jax.Array, r: jax.Array, turn: jax.Array | None):
    cell = _cell(texture.shape, r, turn)
    return _interpolate(texture, cell), (texture, cell)


def _fetch_backward(saved: tuple[jax.Array, Cell], g: jax.Array):
    """The transpose of the lookup, written out: derived automatically it scatters the corners one channel at a time."""
    texture, cell = saved
    near, far = _corners(texture, cell)
    r = jnp.sum(g * (far - near), axis=0) * (texture.shape[1] - 1)
    return _scatter(texture.shape, cell, g), r, None if cell.along_phi is None else jnp.zeros_like(cell.along_phi)


def _scatter(shape: tuple[int, ...], cell: Cell, g: jax.Array) -> jax.Array:
    channels, n_r, n_phi = shape
    rows = jax.lax.optimization_barrier(g.T)
    texels = jnp.zeros((n_r * (n_phi + 1), channels), g.dtype)
    for offset, weight in _weights(cell, n_phi):
        texels = texels.at[cell.index + offset].add(rows * weight[:, None], mode="promise_in_bounds")
    columns = texels.T.reshape(channels, n_r, n_phi + 1)
    return columns[:, :, :n_phi].at[:, :, 0].add(columns[:, :, n_phi])


def _weights(cell: Cell, n_phi: int) -> list[tuple[int, jax.Array]]:
    """Offset and bilinear weight of each corner."""
    r, phi = cell.along_r, cell.along_phi
    if phi is None:
        return [(0, 1 - r), (n_phi + 1, r)]
    corners = [(0, (1 - r) * (1 - phi)), (1, (1 - r) * phi)]
    return [*corners, (n_phi + 1, r * (1 - phi)), (n_phi + 2, r * phi)]


_fetch.defvjp(_fetch_forward, _fetch_backward)
