"""Angular textures as sums of coarser ones, so that what many directions have in common is learned at once.

A texture T is the sum over k of what T_k, half as fine in each direction as T_(k-1), is between its texels:
T = T_0 + sum_k R_k T_k P_k^T, with hat functions in the columns of R_k and P_k, and T_0 as fine as T. It is linear, so
T itself stays the variable: an optimiser is shown the gradient by each T_k, R_k^T g P_k, and its steps are summed up.
"""

from __future__ import annotations

from functools import reduce

import jax
import jax.numpy as jnp
import numpy as np


def by_resolution(gradient: jax.Array) -> tuple[jax.Array, ...]:
    """Gradients by T_0, T_1, ... of that by T, `(channels, n_r, n_phi)`; the last of one row and one column."""
    coarser = _coarser_bases(*gradient.shape[1:])
    return gradient, *(jnp.einsum("crp,rn,pm->cnm", gradient, rows, columns) for rows, columns in coarser)


def summed(parts: tuple[jax.Array, ...]) -> jax.Array:
    """T of T_0, T_1, ...: the transpose of `by_resolution`."""
    finest, *others = parts
    bases = _coarser_bases(*finest.shape[1:])
    spread = (
        jnp.einsum("cnm,rn,pm->crp", part, rows, columns) for part, (rows, columns) in zip(others, bases, strict=True)
    )
    return reduce(jnp.add, spread, finest)


def _coarser_bases(n_r: int, n_phi: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """R_k and P_k from k = 1 to one texel."""
    count = max(n_r, n_phi).bit_length()
    return [(_hats(n_r, n_r >> k, wraps=False), _hats(n_phi, n_phi >> k, wraps=True)) for k in range(1, count)]


def _hats(fine: int, coarse: int, *, wraps: bool) -> np.ndarray:
    """Values at `fine` texels of the hat functions about `coarse` ones, `(fine, coarse)`; each row sums to one.

    The azimuth wraps; the radius keeps its last value beyond the last coarse texel. There is at least one of these.
    """
    coarse = max(coarse, 1)
    place = (np.arange(fine) + 0.5) * coarse / fine - 0.5
    below = np.floor(place).astype(int)
    values = np.zeros((fine, coarse), np.float32)
    for texel, weight in ((below, 1.0 - (place - below)), (below + 1, place - below)):
        column = texel % coarse if wraps else np.clip(texel, 0, coarse - 1)
        np.add.at(values, (np.arange(fine), column), weight)
    return values
