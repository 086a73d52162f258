"""Warps of hemisphere and sphere: round trips, densities by Jacobian, edges."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.sampling import hemisphere, sphere

WARPS = {
    "cosine": (hemisphere.square_to_cosine, hemisphere.cosine_to_square, hemisphere.cosine_density),
    "uniform": (hemisphere.square_to_uniform, hemisphere.uniform_to_square, hemisphere.uniform_density),
    "sphere": (sphere.square_to_sphere, sphere.sphere_to_square, sphere.sphere_density),
}
CORNERS = np.array([[0, 0], [0, 1], [1, 0], [1, 1], [0.5, 0.5], [0.5, 0], [1, 0.5], [1e-7, 1e-7]], np.float32)


@pytest.mark.parametrize("name", WARPS)
def test_round_trip(name: str):
    warp, inverse, _ = WARPS[name]
    u = jnp.asarray(np.random.default_rng(0).uniform(0.001, 0.999, (5000, 2)), jnp.float32)
    w = warp(u)
    np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0, atol=3e-7)
    np.testing.assert_allclose(inverse(w), u, atol=2e-6)


@pytest.mark.parametrize("name", WARPS)
def test_density_is_the_inverse_of_the_solid_angle_per_unit_area(name: str):
    warp, _, density = WARPS[name]
    with jax.enable_x64(True):
        u = jnp.asarray(np.random.default_rng(1).uniform(0.03, 0.97, (500, 2)))
        tangents = jax.jit(jax.vmap(jax.jacfwd(warp)))(u)
        area = np.linalg.norm(np.cross(tangents[..., 0], tangents[..., 1]), axis=-1)
        np.testing.assert_allclose(density(warp(u)), 1 / area, rtol=1e-6)


@pytest.mark.parametrize("name", WARPS)
def test_corners_are_unit_vectors(name: str):
    w = np.asarray(WARPS[name][0](jnp.asarray(CORNERS)), float)
    np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0, atol=4e-4 if name == "cosine" else 3e-7)


@pytest.mark.parametrize("name", ["cosine", "uniform"])
def test_nothing_below_the_horizon(name: str):
    warp, _, density = WARPS[name]
    assert np.all(np.asarray(warp(jnp.asarray(CORNERS)))[:, 2] >= 0)
    assert float(density(jnp.array([0.6, 0.0, -0.8]))) == 0.0


@pytest.mark.parametrize(("name", "moment"), [("cosine", 2 / 3), ("uniform", 1 / 2), ("sphere", 0.0)])
def test_mean_cosine(name: str, moment: float):
    warp: Callable = WARPS[name][0]
    z = np.asarray(warp(jax.random.uniform(jax.random.key(2), (100_000, 2))), float)[:, 2]
    assert abs(z.mean() - moment) < 4 * z.std() / np.sqrt(len(z))
