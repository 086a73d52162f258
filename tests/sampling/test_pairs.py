"""The pairs behind every error estimate: their density by Jacobian and chi-square, their weights by means."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.directions import from_half_difference
from jaxbrdf.sampling.hemisphere import square_to_cosine, square_to_uniform
from jaxbrdf.sampling.pairs import (
    draw_pairs,
    draw_weighted,
    half_vector_density,
    importance,
    pair_density,
    square_to_half_vector,
)

COUNT = 2**19


@pytest.fixture(scope="module")
def pairs():
    return jax.jit(draw_pairs, static_argnums=1)(jax.random.key(0), COUNT)


def area(jacobian: np.ndarray) -> np.ndarray:
    """Solid angle of w over area of u, from d w / d u `(n, 3, 2)`."""
    return np.linalg.norm(np.cross(jacobian[..., 0], jacobian[..., 1]), axis=-1)


def surface_volume(jacobian: np.ndarray) -> np.ndarray:
    """Volume in two spheres' tangent planes over volume of u, from d (wi, wo) / d u `(n, 6, 4)`."""
    gram = np.swapaxes(jacobian, -1, -2) @ jacobian
    return np.sqrt(np.linalg.det(gram))


def test_half_difference_jacobian_is_four_cos_d():
    with jax.enable_x64(True):
        u = jnp.asarray(np.random.default_rng(0).uniform(0.05, 0.95, (200, 4)))

        def place(u: jax.Array) -> jax.Array:
            return jnp.concatenate(from_half_difference(square_to_cosine(u[:2]), square_to_uniform(u[2:])))

        volume = surface_volume(np.asarray(jax.jit(jax.vmap(jax.jacfwd(place)))(u)))
        parts = [
            area(np.asarray(jax.jit(jax.vmap(jax.jacfwd(f)))(v)))
            for f, v in ((square_to_cosine, u[:, :2]), (square_to_uniform, u[:, 2:]))
        ]
        cos_d = np.asarray(square_to_uniform(u[:, 2:]))[:, 2]
    np.testing.assert_allclose(volume, 4 * cos_d * parts[0] * parts[1], rtol=1e-8)


def test_half_vector_density_is_the_warps():
    with jax.enable_x64(True):
        u = jnp.asarray(np.random.default_rng(1).uniform(0.02, 0.98, (300, 2)))
        jacobian = np.asarray(jax.jit(jax.vmap(jax.jacfwd(square_to_half_vector)))(u))
        np.testing.assert_allclose(half_vector_density(square_to_half_vector(u)), 1 / area(jacobian), rtol=1e-6)


def test_half_vectors_cover_every_scale():
    theta = np.asarray(
        jnp.arccos(square_to_half_vector(jax.random.uniform(jax.random.key(1), (50_000, 2)))[:, 2]), float
    )
    for low, high in ((0.0, 1e-3), (1e-3, 1e-2), (1e-2, 0.1), (0.1, 1.6)):
        assert np.mean((theta >= low) & (theta < high)) > 0.15


def test_mixture_density_is_half_of_each_kind():
    with jax.enable_x64(True):
        u = jnp.asarray(np.random.default_rng(2).uniform(0.02, 0.98, (300, 4)))

        def place(u: jax.Array) -> jax.Array:
            return jnp.concatenate(from_half_difference(square_to_half_vector(u[:2]), square_to_uniform(u[2:])))

        volume = surface_volume(np.asarray(jax.jit(jax.vmap(jax.jacfwd(place)))(u)))
        wi, wo = jnp.split(jax.jit(jax.vmap(place))(u), 2, axis=-1)
        cosines = np.maximum(wi[:, 2], 0) * np.maximum(wo[:, 2], 0) / np.pi**2
        np.testing.assert_allclose(jax.jit(pair_density)(wi, wo), 0.5 * cosines + 0.5 / volume, rtol=1e-5)


def test_importance_averages_to_one_and_is_bounded(pairs):
    weights = np.asarray(importance(pairs), float)
    assert abs(weights.mean() - 1) < 4 * weights.std() / np.sqrt(COUNT)
    assert weights.max() <= 2 + 1e-5
    below = (np.asarray(pairs.wi)[:, 2] <= 0) | (np.asarray(pairs.wo)[:, 2] <= 0)
    assert below.any()
    assert not weights[below].any()


@pytest.mark.parametrize("power", [0, 1, 4])
def test_weighted_means_are_the_cosine_means(pairs, power: int):
    """E (wi . wo)^p cos_i^p over cosine-distributed pairs, against cosine draws themselves."""

    def g(wi: jax.Array, wo: jax.Array) -> np.ndarray:
        return np.asarray(jnp.exp(jnp.sum(wi * wo, -1)) * wi[:, 2] ** power, float)

    u = jax.random.uniform(jax.random.key(2), (2, COUNT, 2))
    plain = g(square_to_cosine(u[0]), square_to_cosine(u[1]))
    ours = g(pairs.wi, pairs.wo) * np.asarray(importance(pairs), float)
    error = np.hypot(plain.std(), ours.std()) / np.sqrt(COUNT)
    assert abs(plain.mean() - ours.mean()) < 4 * error


def test_the_mean_of_a_narrow_lobe_is_found():
    """E[D-like bump of width 1e-3 in sin theta_h] has a closed form: integrate cos_i cos_o over half vectors near z."""
    pairs = jax.jit(draw_pairs, static_argnums=1)(jax.random.key(3), COUNT)
    wh = np.asarray(pairs.wi + pairs.wo, float)
    sin_squared = (wh[:, 0] ** 2 + wh[:, 1] ** 2) / np.sum(wh * wh, -1)
    term = np.where(sin_squared < 1e-6, 1.0, 0.0) * np.asarray(importance(pairs), float)
    # area of the cap times 4 cos_d cos_d cos_d / pi^2 integrated over the difference hemisphere: 4 (2 pi / 4) / pi^2
    want = np.pi * 1e-6 * 2 / np.pi
    assert abs(term.mean() - want) < 4 * term.std() / np.sqrt(COUNT)
    assert term.std() / np.sqrt(COUNT) < 0.02 * want


def test_weighted_queries_are_all_above_the_horizon():
    query, weights = jax.jit(draw_weighted, static_argnums=1)(jax.random.key(4), 4096)
    assert np.all(np.asarray(query.wi)[:, 2] > 0)
    assert np.all(np.asarray(query.wo)[:, 2] > 0)
    assert np.all(np.isfinite(weights))


def test_an_odd_count_is_refused():
    with pytest.raises(ValueError, match="even"):
        draw_pairs(jax.random.key(0), 7)
