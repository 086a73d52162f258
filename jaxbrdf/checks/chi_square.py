"""Pearson's chi-square test of a sampler against the density it claims.

Directions below the horizon, which a BRDF's density need not cover, are one cell of their own: whatever the density
lacks to one is expected there, so a sampler that loses more or fewer draws than its density says fails too.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from jaxbrdf.checks.compiled import densities, draws
from jaxbrdf.checks.partition import Partition, polar
from jaxbrdf.types import Brdf, Params, Query


class ChiSquare(NamedTuple):
    """Pearson's statistic, its degrees of freedom and the chance of a larger one if the sampler is right."""

    statistic: float
    degrees: int
    p_value: float


def significance_of_each(significance: float, tests: int) -> float:
    """Level for each of `tests` independent tests so that all together err with `significance` (Šidák 1967)."""
    return -float(np.expm1(np.log1p(-significance) / tests))


def chi_square(
    key: jax.Array,
    brdf: Brdf,
    params: Params,
    wo: jax.Array,
    *,
    partition: Partition | None = None,
    samples: int = 200_000,
    cells: int = 24,
    points: int = 16,
) -> ChiSquare:
    """Test `brdf.sample` against `brdf.pdf` for one viewer `wo`, `(3,)`; its dtype is the one tested.

    Args:
        partition: how to cut the sphere, by default in rings and sectors about the normal.
        samples: number of draws.
        cells: number of cells along each side of the unit square.
        points: midpoint nodes along each side of a cell, to integrate the density.

    Raises:
        ValueError: the BRDF has no sampler.
    """
    partition = polar() if partition is None else partition
    mass = expected_mass(brdf, params, wo, partition=partition, cells=cells, points=points)
    u = jax.random.uniform(key, (samples, 3), wo.dtype)
    drawn = np.asarray(draws(brdf, params, jnp.broadcast_to(wo, u.shape), u).wi, np.float64)
    return chi_square_of_draws(drawn, mass, partition=partition)


def chi_square_of_draws(drawn: np.ndarray, mass: np.ndarray, *, partition: Partition) -> ChiSquare:
    """The same of directions `drawn`, `(n, 3)`, however they were made, and the cells' `expected_mass`."""
    observed, lost = _observed(drawn, partition, round(len(mass) ** 0.5))
    expected = len(drawn) * mass
    return pearson(np.append(observed, lost), np.append(expected, max(len(drawn) - expected.sum(), 0.0)))


def pearson(observed: np.ndarray, expected: np.ndarray, *, least: float = 5.0) -> ChiSquare:
    """The test on counts `(n,)`; the cells that expect least are pooled until the pool expects `least`."""
    order = np.argsort(expected)
    observed, expected = observed[order], expected[order]
    pooled = min(int(np.searchsorted(np.cumsum(expected), least)) + 1, len(expected))
    observed = np.append(observed[pooled:], observed[:pooled].sum())
    expected = np.append(expected[pooled:], expected[:pooled].sum())
    degrees = max(len(expected) - 1, 1)
    statistic = float(np.sum(np.square(observed - expected) / expected))
    return ChiSquare(statistic, degrees, float(stats.chi2.sf(statistic, degrees)))


def _observed(w: np.ndarray, partition: Partition, cells: int) -> tuple[np.ndarray, int]:
    """Counts by cell of the directions above the horizon, and the number below it."""
    above = w[w[:, 2] > 0]
    index = np.clip((partition.locate(above) * cells).astype(int), 0, cells - 1)
    return np.bincount(index[:, 0] * cells + index[:, 1], minlength=cells * cells), len(w) - len(above)


def expected_mass(
    brdf: Brdf, params: Params, wo: jax.Array, *, partition: Partition, cells: int = 24, points: int = 16
) -> np.ndarray:
    """Integral of `brdf.pdf` over each cell above the horizon by the midpoint rule, `(cells * cells,)`.

    Raises:
        ValueError: the BRDF has no sampler.
    """
    side = (np.arange(cells * points) + 0.5) / (cells * points)
    directions, area = partition.place(np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2))
    wi = jnp.asarray(directions, wo.dtype)
    density = densities(brdf, params, Query(wi, jnp.broadcast_to(wo, wi.shape)))
    mass = np.where(np.asarray(wi)[:, 2] > 0, np.asarray(density, np.float64), 0.0) * area / len(side) ** 2
    return mass.reshape(cells, points, cells, points).sum((1, 3)).ravel()
