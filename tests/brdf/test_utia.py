from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from jaxbrdf.brdf import utia
from jaxbrdf.data.utia import SHAPE, Utia
from jaxbrdf.types import Query
from tests.brdf.pairs import uniform_directions

COUNT = 600
QUERY = Query(*(jnp.asarray(uniform_directions(seed, COUNT), jnp.float32) for seed in (1, 2)))


@pytest.fixture(scope="module")
def table() -> Utia:
    return Utia(np.random.default_rng(0).random((*SHAPE, 3)))


def scipy_reference(table: Utia, query: Query) -> np.ndarray:
    """Linear in every angle, azimuth closed to a circle, and on along the line beyond 75 degrees."""
    closed = np.concatenate([table.rgb, table.rgb[:, :1]], axis=1)
    closed = np.concatenate([closed, closed[:, :, :, :1]], axis=3)
    theta, phi = np.arange(6) * 15.0, np.arange(49) * 7.5
    interpolant = RegularGridInterpolator((theta, phi, theta, phi), closed, bounds_error=False, fill_value=None)
    angles = []
    for w in query[:2]:
        v = np.asarray(w, np.float64)
        angles.append(np.degrees(np.arctan2(np.hypot(v[:, 0], v[:, 1]), v[:, 2])))
        angles.append(np.degrees(np.arctan2(v[:, 1], v[:, 0])) % 360.0)
    return interpolant(np.stack(angles, axis=-1))


def test_agrees_with_scipy(table: Utia) -> None:
    material = utia.material(table, "made")
    expected = scipy_reference(table, QUERY)
    raw = jax.jit(utia.unclamped)(material.params, QUERY)
    np.testing.assert_allclose(raw, expected, atol=1e-4)
    assert np.any(expected < 0)
    value = jax.jit(material.brdf.eval)(material.params, QUERY)
    np.testing.assert_allclose(value, np.maximum(expected, 0.0), atol=1e-4)


def test_light_and_viewer_are_not_mixed_up(table: Utia) -> None:
    only = np.zeros((*SHAPE, 3))
    only[3, 12, 0, :] = 1.0
    material = utia.material(Utia(only), "made")
    light = jnp.array([0.0, np.sin(np.pi / 4), np.cos(np.pi / 4)], jnp.float32)
    viewer = jnp.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(material.brdf.eval(material.params, Query(light, viewer)), 1.0, rtol=1e-5)
    np.testing.assert_allclose(material.brdf.eval(material.params, Query(viewer, light)), 0.0, atol=1e-5)


def test_zero_below_the_horizon_and_finite_at_the_edges(table: Utia) -> None:
    material = utia.material(table, "made")
    evaluate = jax.jit(material.brdf.eval)
    down = QUERY.wi * jnp.array([[1.0, 1.0, -1.0]])
    assert not np.any(evaluate(material.params, Query(down, QUERY.wo)))
    edge = jnp.array([[0.0, 0.0, 1.0], [-1.0, -0.0, 1e-20], [-1.0, 0.0, 1e-20], [1.0, 0.0, 1e-20]])
    assert np.all(np.isfinite(evaluate(material.params, Query(edge, edge[::-1]))))
    assert not material.isotropic
