"""Moments of slopes against Monte Carlo and closed forms, and the roughness made of them against SciPy's root."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from scipy.linalg import sqrtm

from jaxbrdf.core.roughness import Tensor
from jaxbrdf.sampling.footprints import turned_footprint
from jaxbrdf.surface.slopes import moments_of, pack_slopes, roughness_of, slopes_of
from jaxbrdf.texture.lookup import anisotropic
from jaxbrdf.texture.pyramid import Layout, build_pyramid
from tests.surface.maps import metal, normals

SIZE = 64
LAYOUT = Layout(SIZE, SIZE)
AMPLITUDES, TURNS = np.array([0.3, 0.2]), np.array([1.0, 1.0])


def slopes_at(uv: np.ndarray) -> np.ndarray:
    """Two waves, s_x along u and s_y along the diagonal, about a mean slope."""
    phase = np.stack([uv[..., 0] * TURNS[0], (uv[..., 0] + uv[..., 1]) * TURNS[1]], axis=-1)
    return AMPLITUDES * np.sin(2 * np.pi * phase) + [0.1, -0.3]


def found_moments(uv: np.ndarray, footprint: np.ndarray):
    side = (np.arange(SIZE) + 0.5) / SIZE
    map_ = normals(slopes_at(np.stack(np.meshgrid(side, side), axis=-1)))
    texels = build_pyramid(LAYOUT, pack_slopes(metal(0.4), map_))
    return moments_of(anisotropic(LAYOUT, texels, jnp.float32(uv), jnp.float32(footprint), probes=16))


def test_slopes_are_those_of_the_normals():
    slopes = np.random.default_rng(0).normal(size=(3, 4, 2))
    np.testing.assert_allclose(slopes_of(normals(slopes)), slopes, rtol=1e-5)
    assert np.isfinite(slopes_of(jnp.array([[1.0, 0.0, 0.0]]))).all()


def test_moments_are_those_of_points_drawn_under_the_footprint():
    rng = np.random.default_rng(2)
    uv = rng.uniform(size=(20, 2))
    footprint = np.asarray(turned_footprint(jnp.full(20, 0.25), jnp.full(20, 0.1), jnp.linspace(0.0, 3.0, 20)))
    points = uv[:, None] + np.einsum("nij,nkj->nki", footprint, 0.5 * rng.normal(size=(20, 20_000, 2)))
    slopes = slopes_at(points)
    own = found_moments(uv, footprint)
    # a trilinear lookup's filter has the Gaussian's covariance, not its form
    np.testing.assert_allclose(own.slope, slopes.mean(1), atol=0.02)
    centred = slopes - slopes.mean(1, keepdims=True)
    want = np.einsum("nki,nkj->nij", centred, centred) / 20_000
    np.testing.assert_allclose(own.covariance.a, want[:, 0, 0], atol=0.006)
    np.testing.assert_allclose(own.covariance.b, want[:, 1, 1], atol=0.006)
    np.testing.assert_allclose(own.covariance.c, want[:, 0, 1], atol=0.006)
    assert np.ptp(want[:, 0, 0]) > 0.02


def test_the_whole_map_has_the_moments_of_its_waves():
    own = found_moments(np.zeros((1, 2)), 8.0 * np.eye(2)[None])
    np.testing.assert_allclose(own.slope[0], [0.1, -0.3], atol=1e-6)
    np.testing.assert_allclose(own.covariance, np.array([[0.045], [0.02], [0.0]]), atol=1e-6)
    np.testing.assert_allclose(own.alpha_squared, 0.4**4, rtol=1e-5)


def test_roughness_is_the_root():
    rng = np.random.default_rng(3)
    half = rng.normal(size=(30, 2, 2)) * np.array([1e-3, 0.1, 3.0]).repeat(10)[:, None, None]
    covariance = half @ half.transpose(0, 2, 1)
    tensor = Tensor(*(jnp.float32(covariance[:, i, j]) for i, j in ((0, 0), (1, 1), (0, 1))))
    own = roughness_of(tensor, jnp.full(30, 0.01))
    want = np.stack([sqrtm(2.0 * c + 0.01 * np.eye(2)) for c in covariance])
    for entry, (i, j) in zip(own, ((0, 0), (1, 1), (0, 1)), strict=True):
        np.testing.assert_allclose(entry, want[:, i, j], rtol=1e-4, atol=1e-5)


def test_what_is_no_covariance_still_gives_a_roughness():
    wrong = Tensor(jnp.array([-1e-7, 0.0, 1.0, 5e3]), jnp.array([0.1, 0.0, 1.0, 5e3]), jnp.array([0.2, 0.0, 1.1, 5e3]))
    alpha_squared = jnp.full(4, 1e-8)
    slopes = jax.jacrev(lambda t: jnp.stack(roughness_of(t, alpha_squared)).sum())(wrong)
    assert all(np.isfinite(slope).all() for slope in slopes)
    own = roughness_of(wrong, alpha_squared)
    assert bool((own.determinant() > 0).all())
    np.testing.assert_allclose([own.a[1], own.b[1], own.c[1]], [1e-4, 1e-4, 0.0], rtol=1e-6)
