"""The ellipse of a footprint against LAPACK, where it keeps its digits and where it has none."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.texture.footprint import ellipse, lod_of, probes_of
from jaxbrdf.texture.pyramid import Layout

LAYOUT = Layout(32, 8)
HARD = {
    "zero": (0, 0, 0, 0),
    "singular": (0.3, 0.6, 0.2, 0.4),
    "column": (0, 1, 0, 2),
    "round": (0.4, 0, 0, 0.1),
    "mirrored": (0.4, 0, 0, -0.1),
    "turned": (0, -0.4, 0.1, 0),
    "almost round": (0.4, 1e-8, 0, 0.1),
    "large": (1e20, 1e30, -1e25, 3),
    "small": (1e-20, 2e-25, 1e-30, -1e-22),
}


def random() -> np.ndarray:
    rng = np.random.default_rng(0)
    return (rng.normal(size=(500, 2, 2)) * 10.0 ** rng.uniform(-4, 4, (500, 2, 2))).astype(np.float32)


def test_singular_values_and_axis_are_lapacks():
    footprint = random()
    found = jax.jit(lambda j: ellipse(LAYOUT, j))(jnp.asarray(footprint))
    axes, values, _ = np.linalg.svd(np.diag([8.0, 32.0])[None] @ footprint.astype(np.float64))
    np.testing.assert_allclose(found.major, values[:, 0], rtol=1e-6)
    assert (np.abs(found.minor - values[:, 1]) <= 1e-6 * values[:, 0]).all()
    np.testing.assert_allclose(found.excess, (values[:, 0] ** 2 - values[:, 1] ** 2) / 4, rtol=3e-6)
    across = found.x * axes[:, 1, 0] - found.y * axes[:, 0, 0]
    # as far as the axis is determined
    assert (np.abs(across) * (1 - values[:, 1] / values[:, 0]) < 1e-6).all()
    np.testing.assert_allclose(np.hypot(found.x, found.y), 1, rtol=1e-6)


@pytest.mark.parametrize("entries", HARD.values(), ids=HARD)
def test_hard_footprints_have_finite_values_and_gradients(entries: tuple[float, ...]):
    footprint = jnp.asarray(entries, jnp.float32).reshape(2, 2)
    found, jacobian = GRADIENTS(footprint)
    values = np.linalg.svd(np.clip(np.diag([8.0, 32.0]) @ np.asarray(footprint, np.float64), -(2.0**30), 2.0**30))[1]
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves((found, jacobian)))
    assert float(found.major) == pytest.approx(values[0], rel=1e-6, abs=3e-18)
    assert float(found.minor) == pytest.approx(values[1], abs=1e-6 * values[0] + 3e-18)
    assert np.hypot(found.x, found.y) == pytest.approx(1.0, rel=1e-6)


GRADIENTS = jax.jit(lambda j: (ellipse(LAYOUT, j), jax.jacrev(lambda j: ellipse(LAYOUT, j))(j)))


def test_a_nan_is_not_hidden():
    found = ellipse(LAYOUT, jnp.asarray([[[jnp.nan, 0], [0, 1]], [[0, 0], [0, jnp.nan]]]))
    assert np.isnan([found.major, found.minor]).all()


def test_lod_has_the_variance_that_is_asked_for():
    layout = Layout(64, 64)
    scale = np.array([0, 0.5, 1, 1.3, 2, 3, 31.9, 32, 64, 65, 1e30])
    found = np.asarray(jax.jit(lambda scale: lod_of(layout, scale))(jnp.asarray(scale, jnp.float32)), np.float64)
    below = np.floor(found)
    variance = 4**below * (1 + 3 * (found - below)) / 4
    np.testing.assert_allclose(variance, np.clip(scale, 1, 64) ** 2 / 4, rtol=3e-6)


@pytest.mark.parametrize("most", [1, 2, 16])
def test_probes_have_the_covariance_and_no_gaps(most: int):
    layout = Layout(2**20, 2**20)
    footprint = random() / 1e3
    found = jax.jit(lambda j: probes_of(layout, j, most=most))(jnp.asarray(footprint))
    values = np.linalg.svd(2.0**20 * footprint.astype(np.float64))[1]
    step = 2.0**20 * np.hypot(found.u, found.v)
    count, level = (np.asarray(x, np.float64) for x in (found.count, found.lod))
    minor = np.maximum(values[:, 1], np.maximum(values[:, 0] / most, 1))
    variance = 4 ** np.floor(level) * (1 + 3 * (level % 1)) / 4
    fits = minor < 2.0**20
    np.testing.assert_allclose(variance[fits], (minor**2 / 4)[fits], rtol=1e-5)
    along = variance + step**2 * (count**2 - 1) / 12
    np.testing.assert_allclose(along[fits], np.maximum(values[:, 0], 1)[fits] ** 2 / 4, rtol=1e-5)
    assert ((count >= 1) & (count <= most)).all()
    assert (step <= np.where(count < most, 1.00001, 1.7321) * minor).all()
    assert len(np.unique(count)) >= most - 1
