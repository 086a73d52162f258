"""The smoothing of updates as the operator K that it stands for, and the equivalence that its docstring claims."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.fit.optimiser import OptimiserConfig, adam
from jaxbrdf.texture.preconditioner import falloff, smooth, smooth_pyramid
from jaxbrdf.texture.pyramid import Layout, Wrap

SIZES = [(5, 8), (4, 1), (6, 7)]


def operator(n_r: int, n_phi: int, strength: float) -> np.ndarray:
    """K as a matrix over the texels of one channel."""
    units = jnp.eye(n_r * n_phi).reshape(-1, n_r, n_phi)
    return np.asarray(smooth(units, strength)).reshape(n_r * n_phi, -1).T.astype(np.float64)


@pytest.mark.parametrize(("n_r", "n_phi"), SIZES)
def test_it_is_symmetric_positive_and_keeps_constants(n_r: int, n_phi: int):
    k = operator(n_r, n_phi, 5.0)
    np.testing.assert_allclose(k, k.T, atol=1e-6)
    np.testing.assert_allclose(k @ np.ones(len(k)), 1.0, atol=1e-6)
    eigenvalues = np.linalg.eigvalsh(0.5 * (k + k.T))
    np.testing.assert_allclose(eigenvalues[-1], 1.0, atol=1e-6)
    # the finest detail of radius and azimuth together, sqrt(1/2) cycles a texel
    assert eigenvalues[0] >= 1 / (1 + 5.0 * np.sqrt(0.5)) - 1e-6


def test_a_wave_round_the_azimuth_is_damped_by_the_papers_falloff():
    n_r, n_phi, cycles = 6, 16, 3
    wave = jnp.cos(2 * jnp.pi * cycles * jnp.arange(n_phi) / n_phi)
    texture = jnp.broadcast_to(wave[None, None], (2, n_r, n_phi))
    np.testing.assert_allclose(smooth(texture, 5.0), np.asarray(texture) / (1 + 5.0 * cycles / n_phi), atol=1e-6)


def test_centre_and_rim_do_not_touch_but_the_azimuth_does():
    spread = smooth(jnp.zeros((1, 16, 16)).at[0, 0, 0].set(1.0), 5.0)[0]
    assert float(spread[0, 15]) == pytest.approx(float(spread[0, 1]), rel=1e-4)
    assert float(spread[15, 0]) < 0.1 * float(spread[1, 0])


@pytest.mark.parametrize("wrap", ["repeat", "clamp"])
def test_of_a_pyramid_it_is_symmetric_and_keeps_every_level_to_itself(wrap: Wrap):
    layout = Layout(3, 6, wrap)
    k = np.asarray(jax.jit(lambda texels: smooth_pyramid(layout, texels, 10.0))(jnp.eye(layout.texels)))
    np.testing.assert_allclose(k, k.T, atol=1e-6)
    numbers = np.repeat(np.arange(layout.top + 1), [rows * columns for rows, columns in layout.sizes])
    np.testing.assert_allclose(np.abs(k[numbers[:, None] != numbers[None, :]]), 0.0, atol=0.0)
    np.testing.assert_allclose(k @ np.ones(len(k)), 1.0, atol=1e-6)
    assert np.linalg.eigvalsh(0.5 * (k + k.T))[0] >= 1 / (1 + 10.0 * np.sqrt(0.5)) - 1e-6
    # the two ends of the first row touch or do not
    assert k[0, 5] == pytest.approx(k[0, 1], rel=1e-4) if wrap == "repeat" else k[0, 5] < 0.5 * k[0, 1]


def test_without_strength_nothing_changes():
    texture = jnp.asarray(np.random.default_rng(0).standard_normal((2, 5, 6)), jnp.float32)
    np.testing.assert_allclose(smooth(texture, 0.0), texture, atol=1e-6)
    np.testing.assert_array_equal(falloff(5, 6, 0.0), 1.0)


def test_adam_on_raw_texels_is_preconditioned_adam_on_the_texture():
    """Raw r with T = K r under plain Adam, in float64 as printed by Kingma and Ba, against `adam` on T itself."""
    n_r, n_phi, config = 4, 6, OptimiserConfig(texture_rate=1e-2, beta1=0.9, beta2=0.99, epsilon=1e-8, smoothing=5.0)
    k = operator(n_r, n_phi, config.smoothing)
    rng = np.random.default_rng(0)
    target, curvature = rng.standard_normal(n_r * n_phi), rng.uniform(0.5, 2.0, n_r * n_phi)
    raw = rng.standard_normal(n_r * n_phi)
    texture = jnp.asarray(k @ raw, jnp.float32).reshape(1, n_r, n_phi)
    optimiser = adam(config)
    update = jax.jit(optimiser.update)
    state, first, second = optimiser.init(texture), np.zeros(len(raw)), np.zeros(len(raw))
    for step in range(1, 26):
        raw_gradient = k.T @ (curvature * (k @ raw - target))
        first = 0.9 * first + 0.1 * raw_gradient
        second = 0.99 * second + 0.01 * raw_gradient**2
        raw = raw - 1e-2 * (first / (1 - 0.9**step)) / (np.sqrt(second / (1 - 0.99**step)) + 1e-8)
        gradient = jnp.asarray(curvature, jnp.float32) * (texture.ravel() - jnp.asarray(target, jnp.float32))
        updates, state = update(gradient.reshape(texture.shape), state, texture)
        texture = texture + updates
    moved = np.abs(np.asarray(texture).ravel() - k @ raw)
    assert moved.max() < 1e-4
