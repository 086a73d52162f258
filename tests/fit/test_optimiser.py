"""Rates, moments and schedules of the optimiser."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.fit.optimiser import OptimiserConfig, adam, cosine, staircase
from jaxbrdf.texture.multiresolution import by_resolution, summed


class TwoGroups(NamedTuple):
    """A texture, which rank 3 makes it, and weights."""

    texture: jax.Array
    weights: jax.Array


def drawn(seed: int) -> TwoGroups:
    rng = np.random.default_rng(seed)
    return TwoGroups(*(jnp.asarray(rng.standard_normal(shape), jnp.float32) for shape in ((2, 4, 5), (4, 3))))


def test_the_first_step_is_each_groups_rate_against_the_gradients_sign():
    gradient = drawn(0)
    optimiser = adam(OptimiserConfig(texture_rate=0.5, network_rate=0.125, smoothing=0.0))
    updates, _ = optimiser.update(gradient, optimiser.init(gradient), gradient)
    np.testing.assert_allclose(updates.texture, -0.5 * np.sign(gradient.texture), rtol=1e-5)
    np.testing.assert_allclose(updates.weights, -0.125 * np.sign(gradient.weights), rtol=1e-5)


def test_later_steps_are_adam_in_float64():
    config = OptimiserConfig(texture_rate=1e-2, network_rate=1e-3, beta1=0.9, beta2=0.95, epsilon=1e-15, smoothing=0.0)
    optimiser = adam(config)
    state = optimiser.init(drawn(0))
    first = second = 0.0
    for step in range(1, 8):
        gradient = drawn(step)
        updates, state = optimiser.update(gradient, state, gradient)
        first = 0.9 * first + 0.1 * np.asarray(gradient.weights, np.float64)
        second = 0.95 * second + 0.05 * np.asarray(gradient.weights, np.float64) ** 2
    expected = -1e-3 * (first / (1 - 0.9**7)) / np.sqrt(second / (1 - 0.95**7))
    np.testing.assert_allclose(updates.weights, expected, rtol=1e-4)


def test_only_textures_are_smoothed():
    gradient = TwoGroups(jnp.zeros((1, 4, 8)).at[0, 2, 3].set(1.0), jnp.zeros((4, 3)).at[1, 1].set(1.0))
    optimiser = adam(OptimiserConfig(smoothing=5.0))
    updates, _ = optimiser.update(gradient, optimiser.init(gradient), gradient)
    assert np.count_nonzero(updates.weights) == 1
    assert np.all(np.asarray(updates.texture) < 0)


def test_resolutions_of_a_texture_step_each_by_its_own_moments():
    config = OptimiserConfig(texture_rate=0.5, network_rate=0.125, smoothing=0.0, multiresolution=True)
    gradient = drawn(0)
    optimiser = adam(config)
    updates, _ = optimiser.update(gradient, optimiser.init(gradient), gradient)
    expected = summed(tuple(jnp.sign(part) for part in by_resolution(gradient.texture)))
    np.testing.assert_allclose(updates.texture, -0.5 * expected, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(updates.weights, -0.125 * np.sign(gradient.weights), rtol=1e-5)


def test_a_few_texels_teach_the_others_by_coarser_resolutions():
    def left(multiresolution: bool) -> float:
        optimiser = adam(OptimiserConfig(5e-2, 0.0, 0.9, 0.99, smoothing=0.0, multiresolution=multiresolution))
        params = TwoGroups(jnp.zeros((1, 16, 16)), jnp.zeros((1, 1)))
        state = optimiser.init(params)
        seen = jnp.zeros((1, 16, 16)).at[0, ::4, ::4].set(1.0)
        for _ in range(60):
            gradient = TwoGroups(seen * (params.texture - 1.0), jnp.zeros((1, 1)))
            updates, state = optimiser.update(gradient, state, params)
            params = jax.tree.map(jnp.add, params, updates)
        return float(jnp.mean(jnp.abs(params.texture - 1.0)))

    assert left(True) < 0.4
    assert left(False) > 0.9


@pytest.mark.parametrize(
    ("step", "factor"), [(0, 1 / 200), (99, 0.5), (199, 1.0), (1000, 0.5), (1500, 0.5 - np.sqrt(0.125)), (2000, 0.0)]
)
def test_cosine_rises_and_falls(step: int, factor: float):
    # while it rises, the cosine is still next to one
    found = float(cosine(jnp.int32(step), jnp.int32(2000)))
    assert found == pytest.approx(factor, rel=0.03, abs=1e-6)


def test_cosine_never_grows_after_its_warm_up():
    steps = jnp.arange(200, 2001)
    assert np.all(np.diff(cosine(steps, jnp.int32(2000))) <= 1e-7)


@pytest.mark.parametrize(("step", "factor"), [(0, 1.0), (9_999, 1.0), (10_000, 0.9), (35_000, 0.729)])
def test_staircase_is_the_papers_decay(step: int, factor: float):
    assert float(staircase(jnp.int32(step), jnp.int32(100_000))) == pytest.approx(factor, rel=1e-6)
