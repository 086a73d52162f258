"""The picture beside its reference, read back."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from jaxbrdf.report.pictures import side_by_side


def panels(picture: bytes) -> list[np.ndarray]:
    """Mean colours of the middles of the three thirds, in [0, 1]."""
    with Image.open(io.BytesIO(picture)) as image:
        pixels = np.asarray(image.convert("RGB")) / 255
    height, width, _ = pixels.shape
    centres = [width // 6, width // 2, 5 * width // 6]
    return [pixels[height // 2 - 20 : height // 2 + 20, x - 20 : x + 20].mean(axis=(0, 1)) for x in centres]


def test_reference_fit_and_difference_stand_side_by_side():
    reference = np.full((32, 32, 3), [0.6, 0.3, 0.1])
    reference[0] = 1.0  # the exposure's white
    fit = reference * np.array([1.0, 0.9, 1.0])
    shown_reference, shown_fit, difference = panels(side_by_side(fit, reference, title="a fit", note="FLIP 0.1"))
    assert shown_reference[0] > shown_reference[1] > shown_reference[2] > 0
    np.testing.assert_allclose(shown_fit[[0, 2]], shown_reference[[0, 2]], atol=0.01)
    np.testing.assert_allclose(difference, 5 * np.abs(shown_fit - shown_reference), atol=0.03)
    assert difference[1] > 0.05


def test_the_same_pictures_give_the_same_file():
    picture = np.random.default_rng(0).uniform(0, 1, (16, 16, 3))
    once, again = (side_by_side(picture, picture, title="a fit", note="") for _ in range(2))
    assert once == again
    assert not panels(once)[2].any()
