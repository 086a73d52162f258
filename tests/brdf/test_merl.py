from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from jaxbrdf.brdf import merl
from jaxbrdf.data.merl import SHAPE, Merl
from jaxbrdf.types import Query
from tests.brdf.pairs import half_difference_angles, uniform_directions

COUNT = 600
QUERY = Query(*(jnp.asarray(uniform_directions(seed, COUNT), jnp.float32) for seed in (1, 2)))
ANGLES = np.array(
    [
        half_difference_angles(*(np.asarray(w, np.float64) for w in pair))
        for pair in zip(QUERY.wi, QUERY.wo, strict=True)
    ]
)
COORDINATES = np.stack(
    [np.sqrt(ANGLES[:, 0] / (np.pi / 2)) * 90, ANGLES[:, 1] / (np.pi / 2) * 90, ANGLES[:, 2] / np.pi * 180], axis=-1
)
"""In cells, by an independent computation in float64."""


@pytest.fixture(scope="module")
def table() -> Merl:
    return Merl(np.random.default_rng(0).random((*SHAPE, 3)), np.ones(SHAPE, bool))


def value(table: Merl, lookup: merl.Lookup, query: Query = QUERY) -> np.ndarray:
    material = merl.material(table, "made", lookup=lookup)
    return np.asarray(jax.jit(material.brdf.eval)(material.params, query))


def test_nearest_is_the_cell_the_angles_fall_in(table: Merl) -> None:
    cells = np.minimum(COORDINATES.astype(int), np.array(SHAPE) - 1)
    inside = np.all(np.abs(COORDINATES - np.rint(COORDINATES)) > 1e-3, axis=-1)
    assert inside.mean() > 0.9
    expected = table.rgb[tuple(cells.T)]
    np.testing.assert_allclose(value(table, "nearest")[inside], expected[inside], rtol=1e-6)


def test_trilinear_agrees_with_scipy_between_cell_centres(table: Merl) -> None:
    around = np.concatenate([table.rgb[:, :, -1:], table.rgb, table.rgb[:, :, :1]], axis=2)
    held = np.pad(around, ((1, 1), (1, 1), (0, 0), (0, 0)), mode="edge")
    axes = [np.arange(-1, n + 1) + 0.5 for n in SHAPE]
    expected = RegularGridInterpolator(axes, held)(COORDINATES)
    np.testing.assert_allclose(value(table, "trilinear"), expected, atol=2e-3)


def test_invalid_cells_have_no_weight() -> None:
    valid = np.random.default_rng(3).random(SHAPE) < 0.7
    constant = Merl(0.25 * valid[..., None] * np.ones(3), valid)
    near = value(constant, "trilinear")
    np.testing.assert_allclose(near[near[:, 0] > 0], 0.25, rtol=1e-5)
    assert np.mean(near[:, 0] > 0) > 0.95
    cells = np.minimum(COORDINATES.astype(int), np.array(SHAPE) - 1)
    inside = np.all(np.abs(COORDINATES - np.rint(COORDINATES)) > 1e-3, axis=-1)
    np.testing.assert_array_equal((value(constant, "nearest")[:, 0] > 0)[inside], valid[tuple(cells.T)][inside])


def test_nothing_valid_nearby_is_zero() -> None:
    valid = np.zeros(SHAPE, bool)
    valid[-1, -1, -1] = True
    assert not np.any(value(Merl(valid[..., None] * np.ones(3), valid), "trilinear"))


@pytest.mark.parametrize("lookup", ["nearest", "trilinear"])
def test_reciprocal_and_zero_below_the_horizon(lookup: merl.Lookup, table: Merl) -> None:
    swapped = value(table, lookup, Query(QUERY.wo, QUERY.wi))
    assert np.mean(np.abs(swapped - value(table, lookup)) > 1e-3) < 0.01
    down = QUERY.wi * jnp.array([[1.0, 1.0, -1.0]])
    assert not np.any(value(table, lookup, Query(down, QUERY.wo)))


def test_degenerate_pairs_are_finite(table: Merl) -> None:
    up, left, right = jnp.array([0.0, 0.0, 1.0]), jnp.array([-1.0, 0.0, 1e-7]), jnp.array([1.0, 0.0, 1e-7])
    query = Query(jnp.stack([up, left, left, up, right]), jnp.stack([up, right, left, right, up]))
    for lookup in ("nearest", "trilinear"):
        assert np.all(np.isfinite(value(table, lookup, query)))


def test_energy_of_a_constant_table_by_its_sampler() -> None:
    material = merl.material(Merl(np.full((*SHAPE, 3), 1.0 / np.pi), np.ones(SHAPE, bool)), "white")
    wo = jnp.broadcast_to(jnp.array([0.6, 0.0, 0.8]), (64, 3))
    drawn = jax.jit(material.brdf.sample)(
        material.params, Query(wo, wo), jax.random.uniform(jax.random.key(0), (64, 3))
    )
    np.testing.assert_allclose(drawn.weight, 1.0, rtol=1e-4)
    np.testing.assert_allclose(drawn.pdf, drawn.wi[:, 2] / np.pi, rtol=1e-5)


def test_unknown_lookup_is_refused() -> None:
    with pytest.raises(ValueError, match="lookup is 'cubic'"):
        merl.brdf("cubic")  # type: ignore[arg-type]
