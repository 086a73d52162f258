"""The tabulated density: chi-square against its weights, round trip, empty cells, high dynamic range, bad input."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.checks.chi_square import pearson
from jaxbrdf.sampling.tabulated import sample_tabulated, tabulate, tabulated_density, tabulated_to_square

WEIGHTS = np.array([[0, 1, 2, 0, 5], [0, 0, 0, 0, 0], [3, 0, 0, 1, 1], [1e-3, 0, 0, 0, 0]])


def uniforms(count: int, seed: int) -> jax.Array:
    return jax.random.uniform(jax.random.key(seed), (count, 2))


@pytest.mark.parametrize("weights", [WEIGHTS, WEIGHTS[:1], WEIGHTS[:, 1:2], np.ones((1, 1)), np.eye(7)], ids=str)
def test_cells_are_hit_in_proportion(weights: np.ndarray):
    point = np.asarray(sample_tabulated(tabulate(weights), uniforms(100_000, 0)).point)
    assert np.all((point >= 0) & (point <= 1))
    cell = np.minimum((point[:, ::-1] * weights.shape).astype(int), np.array(weights.shape) - 1)
    observed = np.bincount(np.ravel_multi_index(cell.T, weights.shape), minlength=weights.size)
    assert not np.any(observed[weights.ravel() == 0])
    if np.count_nonzero(weights) > 1:
        assert pearson(observed, 100_000 * weights.ravel() / weights.sum()).p_value > 1e-3


def test_density_of_draws_and_of_points_agree_with_the_weights():
    table = tabulate(WEIGHTS)
    draw = sample_tabulated(table, uniforms(5000, 1))
    np.testing.assert_allclose(tabulated_density(table, draw.point), draw.density, rtol=1e-6)
    rows, columns = np.indices(WEIGHTS.shape)
    centres = np.stack([(columns + 0.5) / 5, (rows + 0.5) / 4], -1)
    want = WEIGHTS / WEIGHTS.mean()
    np.testing.assert_allclose(tabulated_density(table, jnp.asarray(centres, jnp.float32)), want, rtol=1e-5, atol=1e-6)


def test_inverse():
    table, u = tabulate(WEIGHTS + 0.1), uniforms(2000, 2)
    np.testing.assert_allclose(tabulated_to_square(table, sample_tabulated(table, u).point), u, atol=2e-6)


def test_the_largest_draw_stays_inside_and_in_a_cell_with_mass():
    top = jnp.full((1, 2), np.nextafter(np.float32(1), np.float32(0)))
    for weights in (WEIGHTS, np.eye(3), np.random.default_rng(3).random((300, 500))):
        draw = sample_tabulated(tabulate(weights), top)
        assert np.all(draw.point <= 1)
        assert float(draw.density[0]) > 0


def test_a_sun_of_a_million_leaves_the_rest_unbiased():
    weights = np.random.default_rng(4).random((64, 128))
    weights[20, 30] = 1e6
    table = tabulate(weights)
    draw = sample_tabulated(table, uniforms(400_000, 5))
    # the area of everything but the sun, estimated through the densities
    outside = np.asarray(jnp.floor(draw.point * jnp.array([[128.0, 64.0]])) != jnp.array([[30.0, 20.0]])).any(-1)
    term = outside / np.asarray(draw.density, float)
    assert abs(term.mean() - (1 - 1 / weights.size)) < 4 * term.std() / np.sqrt(len(term))


@pytest.mark.parametrize(
    ("weights", "fault"),
    [
        (np.zeros((2, 2)), "zero"),
        (-np.ones((2, 2)), "negative"),
        (np.full((2, 2), np.nan), "finite"),
        (np.ones(3), "shape"),
    ],
)
def test_bad_weights_are_told(weights: np.ndarray, fault: str):
    with pytest.raises(ValueError, match=fault):
        tabulate(weights)
