"""sRGB against scikit-image's and the standard's corner values."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from skimage.color import rgb2gray, rgb2xyz

from jaxbrdf.core.colour import luminance, srgb_decode, srgb_encode


def test_round_trip_and_end_points():
    x = jnp.linspace(0.0, 1.0, 1001)
    np.testing.assert_allclose(srgb_decode(srgb_encode(x)), x, atol=1e-6)
    np.testing.assert_allclose(srgb_encode(jnp.array([-1.0, 0.0, 1.0, 7.0])), [0, 0, 1, 1], atol=1e-6)


def test_encoding_matches_the_standard():
    # IEC 61966-2-1: linear 0.0031308 joins both branches, mid grey 0.214041 is 0.5 encoded
    np.testing.assert_allclose(srgb_encode(jnp.array([0.0031308, 0.21404114])), [0.04045, 0.5], atol=2e-6)


def test_luminance_is_the_y_of_xyz():
    rgb = np.random.default_rng(0).random((50, 1, 3))
    encoded = np.asarray(srgb_encode(jnp.asarray(rgb, jnp.float32)), float)
    np.testing.assert_allclose(luminance(jnp.asarray(rgb, jnp.float32)), rgb2xyz(encoded)[..., 1], atol=2e-4)
    np.testing.assert_allclose(luminance(jnp.asarray(rgb, jnp.float32)), rgb2gray(rgb), atol=1e-3)


def test_gradients_are_finite_at_black_and_white():
    for x in (-0.5, 0.0, 0.0031308, 1.0, 2.0):
        assert np.isfinite(jax.grad(srgb_encode)(jnp.float32(x)))
        assert np.isfinite(jax.grad(srgb_decode)(jnp.float32(x)))
