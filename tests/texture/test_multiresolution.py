"""Textures as sums of coarser ones."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.texture.multiresolution import by_resolution, summed

SHAPES = [(2, 32, 32), (3, 16, 1), (1, 12, 20)]


def drawn(shape: tuple[int, ...], seed: int = 0) -> jax.Array:
    return jnp.asarray(np.random.default_rng(seed).standard_normal(shape), jnp.float32)


@pytest.mark.parametrize("shape", SHAPES)
def test_gradients_are_those_of_the_sum(shape: tuple[int, int, int]):
    g = drawn(shape)
    parts = tuple(drawn(part.shape, seed) for seed, part in enumerate(by_resolution(g), 1))
    (expected,) = jax.vjp(summed, parts)[1](g)
    for found, wanted in zip(by_resolution(g), expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_constant_of_any_resolution_is_a_constant(shape: tuple[int, int, int]):
    zeros = [jnp.zeros_like(part) for part in by_resolution(drawn(shape))]
    for k in range(len(zeros)):
        parts = (*zeros[:k], zeros[k] + 2.0, *zeros[k + 1 :])
        np.testing.assert_allclose(summed(parts), jnp.full(shape, 2.0), rtol=1e-6)


def test_resolutions_halve_down_to_one_texel():
    assert [part.shape[1:] for part in by_resolution(jnp.zeros((1, 8, 4)))] == [(8, 4), (4, 2), (2, 1), (1, 1)]


def test_what_is_as_fine_stays_as_it_is():
    g = drawn((2, 8, 8))
    np.testing.assert_array_equal(by_resolution(g)[0], g)


def test_a_turned_texture_has_turned_gradients():
    g = drawn((2, 8, 16))
    for k, (found, turned) in enumerate(zip(by_resolution(g), by_resolution(jnp.roll(g, 8, axis=2)), strict=True)):
        np.testing.assert_allclose(turned, jnp.roll(found, 8 >> k, axis=2) if 8 >> k else found, atol=1e-5)
