"""Environments: orientation, interpolation, densities, the studio, bad images."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.render.environment import (
    direction_to_square,
    light_density,
    look_up,
    make_environment,
    sample_light,
    square_to_direction,
)
from jaxbrdf.render.studio import studio
from jaxbrdf.sampling.sphere import square_to_sphere


def sphere(count: int, seed: int) -> jax.Array:
    return square_to_sphere(jax.random.uniform(jax.random.key(seed), (count, 2)))


def test_square_and_sphere_round_trip():
    w = sphere(5000, 0)
    np.testing.assert_allclose(square_to_direction(direction_to_square(w)), w, atol=2e-6)


@pytest.mark.parametrize(
    ("direction", "row", "column"),
    [((0, 1, 0), 0, None), ((0, -1, 0), 7, None), ((0, 0, 1), None, 8), ((1, 0, 0), None, 4), ((-1, 0, 0), None, 12)],
)
def test_orientation(direction: tuple[int, ...], row: int | None, column: int | None):
    image = np.zeros((8, 16, 3))
    rows, columns = slice(row, None if row is None else row + 1), slice(None)
    if column is not None:
        columns = slice(column - 1, column + 1)
    image[rows, columns] = 1.0
    w = jnp.asarray(direction, jnp.float32)[None, :]
    np.testing.assert_allclose(look_up(make_environment(image), w), 1.0, atol=1e-5)


def test_the_seam_and_the_poles_are_continuous():
    environment = make_environment(np.random.default_rng(1).random((8, 16, 3)))
    seam = look_up(environment, jnp.array([[1e-6, 0.3, -0.95], [-1e-6, 0.3, -0.95]]))
    np.testing.assert_allclose(seam[0], seam[1], atol=1e-4)
    assert np.all(np.isfinite(look_up(environment, jnp.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [-0.0, 1.0, -0.0]]))))


def test_density_integrates_to_one_and_is_the_samplers():
    environment = make_environment(studio(height=64))
    density = np.asarray(light_density(environment, sphere(200_000, 2)), float) * 4 * np.pi
    assert abs(density.mean() - 1) < 4 * density.std() / np.sqrt(len(density))
    drawn = sample_light(environment, jax.random.uniform(jax.random.key(3), (5000, 2)))
    again = np.asarray(light_density(environment, drawn.direction))
    # a draw within rounding of a texel's edge may be looked up in its neighbour
    assert np.mean(np.isclose(again, drawn.density, rtol=1e-4)) > 0.999
    np.testing.assert_allclose(look_up(environment, drawn.direction), drawn.radiance, rtol=2e-2, atol=1e-3)


def test_light_sampling_finds_the_flux():
    environment = make_environment(studio(height=64))
    w = sphere(400_000, 4)
    plain = np.asarray(look_up(environment, w), float)[:, 0] * 4 * np.pi
    drawn = sample_light(environment, jax.random.uniform(jax.random.key(5), (100_000, 2)))
    ours = np.asarray(drawn.radiance[:, 0] / drawn.density, float)
    error = np.hypot(plain.std() / np.sqrt(len(plain)), ours.std() / np.sqrt(len(ours)))
    assert abs(plain.mean() - ours.mean()) < 4 * error
    assert ours.std() < 0.3 * plain.std()


def test_studio_is_lit_and_finite():
    image = studio(height=32)
    assert image.shape == (32, 64, 3)
    assert image.dtype == np.float32
    assert np.all(image > 0)
    assert image.max() > 50 * np.median(image)


@pytest.mark.parametrize(
    ("image", "fault"),
    [
        (np.ones((4, 8)), "shape"),
        (np.ones((4, 8, 4)), "shape"),
        (np.zeros((4, 8, 3)), "black"),
        (-np.ones((4, 8, 3)), "negative"),
        (np.full((4, 8, 3), np.inf), "finite"),
    ],
)
def test_bad_images_are_told(image: np.ndarray, fault: str):
    with pytest.raises(ValueError, match=fault):
        make_environment(image)
