"""Tabulated conditional sampling: chi-square, brute force, round trips, memory, robustness."""

from __future__ import annotations

from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.builtin import MATERIALS
from jaxbrdf.brdf.proposed import propose
from jaxbrdf.checks.chi_square import chi_square, significance_of_each
from jaxbrdf.checks.partition import Partition
from jaxbrdf.core.colour import luminance
from jaxbrdf.core.directions import spherical
from jaxbrdf.sampling.conditional import (
    ISOTROPIC,
    ViewGrid,
    conditional,
    locate,
    memory,
    place,
    tabulate_conditional,
)
from jaxbrdf.sampling.defensive import FLOOR
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Material, Query

GRIDS = {
    "glazed-ceramic": ViewGrid(elevations=20, rows=24, columns=48),
    "brushed-aluminium": ViewGrid(elevations=10, azimuths=12, rows=24, columns=48, mirrored=False),
}
EVALUATE = jax.jit(lambda brdf, params, query: brdf.eval(params, query), static_argnums=0)
SEEDS, VIEWERS = (0, 1, 2), (0.0, 0.53, 1.54)


@pytest.fixture(scope="module")
def proposed() -> dict[str, Material]:
    materials = {name: MATERIALS[name]() for name in GRIDS}
    return {
        name: propose(m, conditional(GRIDS[name]), tabulate_conditional(GRIDS[name], m.brdf.eval, m.params))
        for name, m in materials.items()
    }


def rows_and_sectors(wo: jax.Array) -> Partition:
    """Equal steps of elevation, and of azimuth counted from the viewer's: cells that those of a table fill evenly."""
    turn = float(np.arctan2(wo[1], wo[0]))

    def of_points(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        theta, phi = 0.5 * np.pi * points[:, 0], 2 * np.pi * points[:, 1] + turn
        w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
        return w, np.pi**2 * np.sin(theta)

    def to_points(w: np.ndarray) -> np.ndarray:
        theta = np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2])
        return np.stack([theta * 2 / np.pi, (np.arctan2(w[:, 1], w[:, 0]) - turn) / (2 * np.pi) % 1.0], axis=-1)

    return Partition(of_points, to_points)


@pytest.mark.parametrize("name", GRIDS)
def test_sampler_agrees_with_its_density(proposed: dict[str, Material], name: str):
    level = significance_of_each(0.01, len(GRIDS) * len(SEEDS) * len(VIEWERS))
    for seed, theta in product(SEEDS, VIEWERS):
        wo = spherical(jnp.array(theta), jnp.array(0.7))
        brdf, params = proposed[name].brdf, proposed[name].params
        result = chi_square(jax.random.key(seed), brdf, params, wo, partition=rows_and_sectors(wo), samples=50_000)
        assert result.p_value > level, (theta, result)


def light_within(
    material: Material, wo: jax.Array, elevations: tuple[float, float], azimuths: tuple[float, float], count: int
) -> float:
    """Integral of the luminance of f cos over a patch, by `count` squared midpoints in the angles."""
    middle = (np.arange(count) + 0.5) / count
    theta, phi = (low + middle * (high - low) for low, high in (elevations, azimuths))
    theta, phi = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    wi = spherical(jnp.asarray(theta, jnp.float32), jnp.asarray(phi, jnp.float32))
    f = luminance(EVALUATE(material.brdf, material.params, Query(wi, jnp.broadcast_to(wo, wi.shape))))
    area = (elevations[1] - elevations[0]) * (azimuths[1] - azimuths[0])
    return float(np.mean(np.asarray(f, float) * np.cos(theta) * np.sin(theta))) * area


@pytest.mark.parametrize("name", GRIDS)
def test_a_cells_density_is_its_share_of_the_light(proposed: dict[str, Material], name: str):
    grid, material = GRIDS[name], MATERIALS[name]()
    tables = tabulate_conditional(grid, material.brdf.eval, material.params, points=4)
    row, column = 0.5 * np.pi / grid.rows, (1 if grid.mirrored else 2) * np.pi / grid.columns
    turn = 0.0 if grid.azimuths == 1 else 2 * np.pi / grid.azimuths
    wo = spherical(jnp.float32(1.5 * np.pi / grid.elevations), jnp.float32(turn))
    cell, whole = (8 * row, 9 * row), (0.0, 0.5 * np.pi)
    share = light_within(material, wo, cell, (turn, turn + column), 16)
    share /= light_within(material, wo, whole, (0.0, 2 * np.pi), 600)
    solid_angle = column * (np.cos(cell[0]) - np.cos(cell[1]))
    centre = spherical(jnp.float32(np.mean(cell)), jnp.float32(turn + 0.5 * column))[None]
    want = (1 - FLOOR) * share / solid_angle + FLOOR * float(centre[0, 2]) / np.pi
    assert float(conditional(grid).pdf(tables, centre, wo[None])[0]) == pytest.approx(want, rel=0.02)


@pytest.mark.parametrize("name", GRIDS)
def test_places_in_a_table_have_their_inverse(name: str):
    grid = GRIDS[name]
    point = jnp.asarray(np.random.default_rng(0).uniform(0.01, 0.99, (5000, 2)), jnp.float32)
    for side in (1.0, -1.0):
        w = place(grid, point, jnp.full(5000, side))
        np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0, atol=3e-7)
        np.testing.assert_allclose(locate(grid, w), point, atol=2e-5)
    if grid.mirrored:
        np.testing.assert_array_equal(jnp.sign(w[:, 1]), -1.0)


def test_memory_of_a_degree_is_the_papers():
    """5.62 MB for a degree in each angle (De Oliveira et al., section 5.2), which are MiB."""
    black = tabulate_conditional(ISOTROPIC, lambda _, query: jnp.zeros_like(query.wi), None)
    assert memory(black) / 2**20 == pytest.approx(5.62, abs=0.005)


def test_nothing_lit_is_without_density(proposed: dict[str, Material]):
    brdf, params = proposed["glazed-ceramic"].brdf, proposed["glazed-ceramic"].params
    u = jax.random.uniform(jax.random.key(1), (2, 20_000, 2))
    wi, wo = square_to_cosine(u)
    pdf = np.asarray(jax.jit(brdf.pdf)(params, Query(wi, wo)), float)
    assert np.all(pdf >= 0.999 * FLOOR * np.asarray(wi)[:, 2] / np.pi)


def test_a_reflectance_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="finite"):
        tabulate_conditional(ViewGrid(2, 1, 2, 2), lambda _, query: jnp.full_like(query.wi, jnp.nan), None)
