"""Tabulated warps against Mitsuba's `MarginalContinuous2D2`, which implements the same published scheme."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf import tabulated_warp
from jaxbrdf.brdf.tabulated_warp import Point

FIRST = np.array([-1.0, 0.0, 0.7], np.float32)
SECOND = np.array([0.0, 0.4, 1.0, 1.5], np.float32)
QUERIES = 300


@pytest.fixture(params=[False, True], ids=["rough", "with zeros"])
def table(request) -> np.ndarray:
    rng = np.random.default_rng(3)
    values = rng.random((3, 4, 7, 9)).astype(np.float32)
    if request.param:
        values[values < 0.5] = 0.0
        values[..., 3, :] = 0.0
    return values


def slices_and_points() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    parameters = np.stack([rng.uniform(-1.3, 1.0, QUERIES), rng.uniform(-0.1, 1.7, QUERIES)], -1)
    return parameters.astype(np.float32), rng.random((QUERIES, 2)).astype(np.float32)


def ours(table: np.ndarray, parameters: np.ndarray):
    warp = tabulated_warp.warp(table.reshape(12, 7, 9))
    knots = jnp.asarray(FIRST), jnp.asarray(SECOND)
    return warp, tabulated_warp.slices(jnp.asarray(parameters[:, 0]), jnp.asarray(parameters[:, 1]), knots)


def test_sample_invert_and_density_agree_with_mitsuba(table: np.ndarray, mitsuba_rgb) -> None:
    theirs = mitsuba_rgb.MarginalContinuous2D2(table, [FIRST.tolist(), SECOND.tolist()])
    parameters, points = slices_and_points()
    warp, where = ours(table, parameters)
    point = Point(jnp.asarray(points[:, 0]), jnp.asarray(points[:, 1]))
    for function, reference in ((tabulated_warp.sample, theirs.sample), (tabulated_warp.invert, theirs.invert)):
        moved, density = jax.jit(function)(warp, where, point)
        expected = [reference(p.tolist(), param=q.tolist()) for p, q in zip(points, parameters, strict=True)]
        np.testing.assert_allclose(np.stack(moved, -1), [list(e[0]) for e in expected], atol=2e-4)
        np.testing.assert_allclose(density, [e[1] for e in expected], rtol=2e-3, atol=2e-3)
    density = jax.jit(tabulated_warp.density)(warp, where, point)
    expected = [theirs.eval(p.tolist(), param=q.tolist()) for p, q in zip(points, parameters, strict=True)]
    np.testing.assert_allclose(density, expected, rtol=1e-4, atol=1e-5)


def test_invert_undoes_sample(table: np.ndarray) -> None:
    parameters, points = slices_and_points()
    warp, where = ours(table, parameters)
    uniform = Point(jnp.asarray(points[:, 0]), jnp.asarray(points[:, 1]))
    back, _ = tabulated_warp.invert(warp, where, tabulated_warp.sample(warp, where, uniform)[0])
    np.testing.assert_allclose(np.stack(back, -1), points, atol=2e-4)


def test_density_integrates_to_one_between_slices() -> None:
    rng = np.random.default_rng(7)
    warp = tabulated_warp.warp(rng.random((2, 5, 6)))
    side = (jnp.arange(400) + 0.5) / 400
    x, y = (axis.reshape(-1) for axis in jnp.meshgrid(side, side))
    knots = jnp.zeros(1), jnp.array([0.0, 1.0])
    where = tabulated_warp.slices(jnp.zeros_like(x), jnp.full_like(x, 0.3), knots)
    assert float(jnp.mean(tabulated_warp.density(warp, where, Point(x, y)))) == pytest.approx(1.0, abs=1e-4)


def test_interpolation_of_one_row_ignores_y() -> None:
    table = jnp.array([1.0, 3.0, 2.0])[None, None, :, None]
    x = jnp.array([-1.0, 0.25, 0.5, 1.0, 2.0])
    where = tabulated_warp.one_slice(x.shape)
    for y in (0.0, 0.7):
        value = tabulated_warp.interpolate(table, where, Point(x, jnp.full_like(x, y)))
        np.testing.assert_allclose(value[:, 0], [1.0, 2.0, 3.0, 2.0, 2.0])
