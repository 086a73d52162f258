from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from jaxbrdf.texture.angular import Polar, close_centre, fetch, polar

RADII = [0.0, 1e-7, 0.2, 0.5, 1.0]
CORNERS = np.array([(r, t) for r in RADII for t in (0.0, 0.3, 6 / 7, 0.99999994)], np.float32)


def places(count: int) -> np.ndarray:
    """Corners of the coordinates and random places, `(2, n)`."""
    return np.concatenate([CORNERS, np.random.default_rng(1).uniform(size=(count, 2))]).astype(np.float32).T


def texture(n_phi: int) -> np.ndarray:
    return np.asarray(close_centre(jnp.asarray(np.random.default_rng(2).normal(size=(3, 6, n_phi)), jnp.float32)))


@pytest.mark.parametrize("n_phi", [1, 2, 7])
def test_a_lookup_is_bilinear_and_wraps(n_phi: int):
    r, turn = places(500)
    texels = texture(n_phi)
    wrapped = np.concatenate([texels, texels[:, :, :1]], axis=2).astype(np.float64)
    at = np.stack([r.astype(np.float64) * 5, turn.astype(np.float64) * n_phi])
    wanted = [map_coordinates(channel, at, order=1) for channel in wrapped]
    np.testing.assert_allclose(fetch(jnp.asarray(texels), Polar(jnp.asarray(r), jnp.asarray(turn))), wanted, atol=3e-6)


def test_a_lookup_without_azimuth_is_linear():
    r, _ = places(500)
    texels = texture(1)
    wanted = [np.interp(r, np.linspace(0, 1, 6), row) for row in texels[:, :, 0]]
    np.testing.assert_allclose(fetch(jnp.asarray(texels), Polar(jnp.asarray(r), None)), wanted, atol=3e-6)


def test_the_centre_is_one_value():
    turn = jnp.linspace(0.0, 0.999, 50)
    found = np.asarray(fetch(jnp.asarray(texture(7)), Polar(jnp.zeros(50), turn)))
    assert (found == found[:, :1]).all()


@pytest.mark.parametrize("with_azimuth", [True, False])
def test_gradients_are_slopes(with_azimuth: bool):
    with jax.enable_x64(True):
        rng = np.random.default_rng(3)
        texels = jnp.asarray(texture(7 if with_azimuth else 1), jnp.float64)
        # away from the texels' borders, where the slope by the radius jumps
        r = jnp.asarray((rng.integers(0, 5, 40) + rng.uniform(0.1, 0.9, 40)) / 5)
        turn = jnp.asarray(rng.uniform(size=40)) if with_azimuth else None
        weights = jnp.asarray(rng.normal(size=(3, 40)))

        @jax.jit
        def total(texels: jax.Array, r: jax.Array) -> jax.Array:
            return jnp.sum(weights * jnp.sin(fetch(texels, Polar(r, turn))))

        by_texels, by_radius = jax.jit(jax.grad(total, argnums=(0, 1)))(texels, r)
        for way in range(8):
            d_texels, d_r = jnp.asarray(rng.normal(size=texels.shape)), jnp.asarray(rng.normal(size=40))
            step = 1e-6
            ends = [total(texels + s * d_texels, r + s * d_r) for s in (step, -step)]
            slope = (ends[0] - ends[1]) / (2 * step)
            found = jnp.sum(by_texels * d_texels) + jnp.sum(by_radius * d_r)
            assert found == pytest.approx(float(slope), rel=1e-6, abs=1e-8), way


def test_gradient_by_texels_of_the_seam_reaches_the_first_column():
    def value(texels: jax.Array) -> jax.Array:
        return fetch(texels, Polar(jnp.asarray([0.6]), jnp.asarray([1 - 0.25 / 7])))[0, 0]

    gradient = np.asarray(jax.jit(jax.grad(value))(jnp.asarray(texture(7))))[0]
    assert gradient[3, 0] == pytest.approx(0.75, abs=1e-5)
    assert gradient[3, 6] == pytest.approx(0.25, abs=1e-5)
    assert gradient.sum() == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("r", [0.0, 1.0])
def test_gradients_are_finite_at_centre_and_rim(r: float):
    def total(texels: jax.Array, r: jax.Array) -> jax.Array:
        return jnp.sum(fetch(close_centre(texels), Polar(r, jnp.asarray([0.0, 0.5]))))

    by_texels, by_radius = jax.jit(jax.grad(total, argnums=(0, 1)))(jnp.asarray(texture(7)), jnp.full(2, r))
    assert np.isfinite(by_texels).all()
    assert np.isfinite(by_radius).all()
    # two lookups of three channels, whose weights are one each
    assert float(by_texels.sum()) == pytest.approx(6.0, rel=1e-6)


@pytest.mark.parametrize("period", [np.pi, 2 * np.pi])
def test_polar_coordinates(period: float):
    phi = np.linspace(-3.1, 3.1, 101)
    w = np.stack([0.6 * np.cos(phi), 0.6 * np.sin(phi), np.full(101, 0.8)], axis=-1)
    at = polar(jnp.asarray(w, jnp.float32), period)
    assert at.turn is not None
    np.testing.assert_allclose(at.r, 0.6, rtol=1e-6)
    assert ((at.turn >= 0) & (at.turn < 1)).all()
    found = np.exp(2j * np.pi * np.asarray(at.turn, np.float64))
    np.testing.assert_allclose(found, np.exp(2j * np.pi * phi / period), atol=3e-6)


def test_no_azimuth_is_no_coordinate():
    assert polar(jnp.asarray([[0.6, 0.0, 0.8]]), None).turn is None


@pytest.mark.parametrize(
    "w", [(0, 0, 1), (-0.0, -0.0, 1), (-1, -0.0, 0), (-1, 0.0, 0), (1, -1e-30, 0), (1.0000001, 0, 0)]
)
def test_polar_coordinates_stay_inside_at_seams(w: tuple[float, float, float]):
    at = polar(jnp.asarray([w], jnp.float32), np.pi)
    assert at.turn is not None
    assert 0 <= float(at.turn[0]) < 1
    assert 0 <= float(at.r[0]) <= 1
