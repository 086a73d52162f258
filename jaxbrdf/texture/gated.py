"""Angular textures of matrices, which a vector multiplies where they are read (Timonen et al., Eq. 6).

A texture is `(n channels, n_r, n_phi)`, the matrices row by row, read as `jaxbrdf.texture.angular` reads it. Fetching
matrices and multiplying them afterwards keeps n channels numbers of every place, and as many of both slopes for the
transpose. Here they are read again instead: g M, one vector for each corner of a cell, has all that the transpose needs
but the outer products of g and z, which are made while they are added to the texture.
"""

from __future__ import annotations

from functools import reduce

import jax
import jax.numpy as jnp

from jaxbrdf.core.staging import staged
from jaxbrdf.texture.angular import Cell, Polar, as_rows, cell_of, corners_of, from_rows


def fetch_gated(texture: jax.Array, at: Polar, z: jax.Array) -> jax.Array:
    """Products M z, `(n, batch)`, of matrices looked up at `(batch,)` coordinates with z `(channels, batch)`.

    Differentiable in the texture, in both coordinates and in z; what a caller does not differentiate is not compiled.

    Raises:
        ValueError: if the texture does not hold whole rows of z's length.
    """
    if texture.shape[0] % z.shape[0]:
        raise ValueError(
            f"texture has {texture.shape[0]} channels; they must be a multiple of those of z, {z.shape[0]}"
        )
    return _fetch(texture, at.r, at.turn, z)


@jax.custom_vjp
def _fetch(texture: jax.Array, r: jax.Array, turn: jax.Array | None, z: jax.Array) -> jax.Array:
    return _forward(texture, r, turn, z)[0]


def _forward(texture: jax.Array, r: jax.Array, turn: jax.Array | None, z: jax.Array):
    cell = cell_of(texture.shape, r, turn)
    texels = staged(as_rows(texture))
    corners = (_read(texels, cell, o) * weight[:, None] for o, weight in corners_of(texture.shape[2], cell))
    matrices = staged(reduce(jnp.add, corners)).T.reshape(-1, *z.shape)
    return jnp.sum(matrices * z[None], axis=1), (texture, cell, z)


def _backward(saved: tuple[jax.Array, Cell, jax.Array], g: jax.Array):
    texture, cell, z = saved
    weights = [weight[None] for _, weight in corners_of(texture.shape[2], cell)]
    sides = _sides(texture, cell, g)
    by_z = reduce(jnp.add, (side * weight for side, weight in zip(sides, weights, strict=True)))
    by_r, by_turn = _slopes(texture.shape, cell, [jnp.sum(side * z, axis=0) for side in sides])
    return _outer_products(texture.shape, cell, g, z), by_r, by_turn, by_z


def _sides(texture: jax.Array, cell: Cell, g: jax.Array) -> list[jax.Array]:
    """g M at each corner, `(channels, batch)`; staged as rows, which are read as runs of memory."""
    texels = as_rows(texture)
    matrices = staged(texels.reshape(texels.shape[0], g.shape[0], -1))

    def side(offset: int) -> jax.Array:
        at = _read(matrices, cell, offset)
        return reduce(jnp.add, (at[:, n] * row[:, None] for n, row in enumerate(g)))

    return [rows.T for rows in staged([side(offset) for offset, _ in corners_of(texture.shape[2], cell)])]


def _slopes(shape: tuple[int, ...], cell: Cell, values: list[jax.Array]) -> tuple[jax.Array, jax.Array | None]:
    """Derivatives by r and turn of what has these values at the corners."""
    if cell.along_phi is None:
        near, far = values
        return (far - near) * (shape[1] - 1), None
    left, right = values[2] - values[0], values[3] - values[1]
    near, far = values[1] - values[0], values[3] - values[2]
    by_r = left + (right - left) * cell.along_phi
    by_turn = near + (far - near) * cell.along_r
    return by_r * (shape[1] - 1), by_turn * shape[2]


def _outer_products(shape: tuple[int, ...], cell: Cell, g: jax.Array, z: jax.Array) -> jax.Array:
    """The texture's gradient: of g and z at every place, times the weights of its corners."""
    _, n_r, n_phi = shape
    texels = jnp.zeros((n_r * (n_phi + 1), g.shape[0], z.shape[0]), g.dtype)
    for offset, weight in corners_of(n_phi, cell):
        products = (g * weight[None]).T[:, :, None] * z.T[:, None, :]
        texels = texels.at[cell.index + offset].add(products, mode="promise_in_bounds")
    return from_rows(shape, texels.reshape(texels.shape[0], -1))


def _read(table: jax.Array, cell: Cell, offset: int) -> jax.Array:
    return table.at[cell.index + offset].get(mode="promise_in_bounds")


_fetch.defvjp(_forward, _backward)
