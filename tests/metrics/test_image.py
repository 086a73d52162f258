"""Image errors: identity, monotony, known shifts, exposure, and shapes that are refused."""

from __future__ import annotations

import numpy as np
import pytest

from jaxbrdf.metrics.image import auto_exposure, image_errors, tonemap


@pytest.fixture
def picture() -> np.ndarray:
    """Something smooth with a highlight of 50, linear."""
    y, x = np.mgrid[-1:1:64j, -1:1:64j]
    return (0.3 + 0.2 * x[..., None] + 50 * np.exp(-80 * (x**2 + y**2))[..., None] * [1, 0.9, 0.7]).astype(np.float32)


def test_equal_images(picture: np.ndarray):
    found = image_errors(picture, picture.copy())
    assert (found.flip, found.mae, found.rmse) == (0.0, 0.0, 0.0)
    assert found.ssim == pytest.approx(1.0)


def test_more_noise_is_worse_by_every_measure(picture: np.ndarray):
    noise = np.random.default_rng(0).normal(size=picture.shape)
    small, large = (image_errors(np.maximum(picture + s * noise, 0), picture, exposure=1.0) for s in (0.01, 0.1))
    assert small.ssim > large.ssim
    assert (small.flip, small.mae, small.rmse) < (large.flip, large.mae, large.rmse)


def test_a_uniform_shift_has_its_own_size():
    # encoded 0.5 and 0.6 by IEC 61966-2-1
    one, other = np.full((16, 16, 3), 0.21404114), np.full((16, 16, 3), 0.31854678)
    found = image_errors(other, one, exposure=1.0)
    assert found.mae == pytest.approx(0.1, abs=1e-6)
    assert found.rmse == pytest.approx(0.1, abs=1e-6)


def test_black_against_white_is_flips_worst():
    found = image_errors(np.ones((32, 32, 3)), np.zeros((32, 32, 3)), exposure=1.0)
    assert found.flip > 0.9
    assert found.mae == pytest.approx(1.0)


def test_differences_beyond_white_are_not_seen(picture: np.ndarray):
    brighter = np.where(picture > 10, 2 * picture, picture)
    assert image_errors(brighter, picture, exposure=1.0).mae == 0.0


def test_exposure_follows_the_reference(picture: np.ndarray):
    assert auto_exposure(4 * picture) == pytest.approx(auto_exposure(picture) / 4, rel=1e-5)
    assert auto_exposure(np.zeros((4, 4, 3))) == 1.0
    assert image_errors(2 * picture, picture).exposure == auto_exposure(picture)


def test_tonemap_is_between_black_and_white(picture: np.ndarray):
    shown = tonemap(picture - 0.4, 3.0)
    assert shown.dtype == np.float32
    assert 0 <= shown.min() <= shown.max() <= 1


@pytest.mark.parametrize("shapes", [((16, 16, 3), (16, 17, 3)), ((16, 16), (16, 16)), ((8, 16, 3), (8, 16, 3))])
def test_unusable_shapes_are_told(shapes: tuple[tuple[int, ...], ...]):
    with pytest.raises(ValueError, match="shape"):
        image_errors(np.ones(shapes[0]), np.ones(shapes[1]))
