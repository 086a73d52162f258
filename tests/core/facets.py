"""Slow, obvious integrals over microfacets by their slopes, apart from the code that they judge."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.chi_square import ChiSquare, pearson
from jaxbrdf.core.roughness import Axes, Isotropic, Roughness, Tensor, Turned


class Case(NamedTuple):
    """A roughness, its matrix, and a mean slope."""

    roughness: Roughness
    matrix: tuple[tuple[float, float], tuple[float, float]]
    slope: tuple[float, float] | None = None


class Facets(NamedTuple):
    """Normals `(n, 3)`, and the area of slopes that each stands for: d wh = cos^3 d slope."""

    wh: np.ndarray
    area: np.ndarray


def _array(value: float) -> jax.Array:
    return jnp.array(value, jnp.float32)


CASES = {
    "mirror": Case(Isotropic(_array(1e-4)), ((1e-4, 0.0), (0.0, 1e-4))),
    "isotropic": Case(Isotropic(_array(0.3)), ((0.3, 0.0), (0.0, 0.3))),
    "axes": Case(Axes(_array(1e-3), _array(0.1)), ((1e-3, 0.0), (0.0, 0.1))),
    # cos = 0.6, sin = 0.8
    "turned": Case(
        Turned(_array(1.0), _array(0.1), jnp.arctan2(_array(0.8), _array(0.6))), ((0.424, 0.432), (0.432, 0.676))
    ),
    "tensor": Case(Tensor(_array(0.5), _array(0.3), _array(-0.2)), ((0.5, -0.2), (-0.2, 0.3))),
    "shifted": Case(Tensor(_array(0.5), _array(0.3), _array(-0.2)), ((0.5, -0.2), (-0.2, 0.3)), (0.5, -0.8)),
    "shifted far": Case(Axes(_array(0.05), _array(0.1)), ((0.05, 0.0), (0.0, 0.1)), (2.0, 0.0)),
}
VIEWS = ((0.0, 0.0), (0.8, 0.7), (1.3, 2.5), (1.5, -2.0), (1.57, 0.1))
"""Polar angle and azimuth; the shifted surfaces turn their backs to some of them."""


def slope_of(case: Case) -> jax.Array | None:
    return None if case.slope is None else jnp.array(case.slope, jnp.float32)


def in_double(tree):
    """The tree's numbers as float64; to be called where x64 is enabled."""
    return jax.tree.map(lambda x: jnp.asarray(np.asarray(x), jnp.float64), tree)


def facets(case: Case, count: int) -> Facets:
    """A grid over a standard hemisphere, uniform in its solid angle, as slopes A t + mean."""
    side = (np.arange(count) + 0.5) / count
    z, phi = (a.ravel() for a in np.meshgrid(side, 2 * np.pi * side, indexing="ij"))
    tangent = np.sqrt(1 - z * z) / z
    matrix = np.asarray(case.matrix)
    standard = np.stack([tangent * np.cos(phi), tangent * np.sin(phi)], -1)
    slope = standard @ matrix + np.asarray(case.slope or (0.0, 0.0))
    normal = np.concatenate([-slope, np.ones((len(slope), 1))], -1)
    area = 2 * np.pi / count**2 / z**3 * np.linalg.det(matrix)
    return Facets(normal / np.linalg.norm(normal, axis=-1, keepdims=True), area)


def standard_cells(case: Case, wh: np.ndarray, cells: int) -> np.ndarray:
    """In which cell of that grid normals lie."""
    slope = -wh[:, :2] / wh[:, 2:] - np.asarray(case.slope or (0.0, 0.0))
    x, y = np.linalg.solve(np.asarray(case.matrix), slope.T)
    place = np.stack([1 / np.sqrt(1 + x * x + y * y), np.arctan2(y, x) / (2 * np.pi) % 1.0])
    index = np.clip((place * cells).astype(int), 0, cells - 1)
    return index[0] * cells + index[1]


def visible_chi_square(case: Case, wo: np.ndarray, wh: np.ndarray, density: np.ndarray, *, cells: int) -> ChiSquare:
    """Of normals drawn for wo, against max(wo . wh, 0) D(wh) at `facets`, of as many nodes a cell as `density` has."""
    count = round(len(density) ** 0.5)
    grid = facets(case, count)
    seen = np.maximum(grid.wh @ wo, 0.0) * density * grid.wh[:, 2] ** 3 * grid.area
    expected = (seen / seen.sum()).reshape(cells, count // cells, cells, count // cells).sum((1, 3)).ravel()
    observed = np.bincount(standard_cells(case, wh, cells), minlength=cells * cells)
    return pearson(observed, len(wh) * expected)


def directions(count: int, seed: int) -> np.ndarray:
    """Random unit vectors above the horizon, float32."""
    w = np.random.default_rng(seed).normal(size=(count, 3))
    w[:, 2] = np.abs(w[:, 2])
    return (w / np.linalg.norm(w, axis=-1, keepdims=True)).astype(np.float32)
