"""The plot over scales, read back."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image

from jaxbrdf.report.scale_plot import scale_plot


def report(*levels: float) -> dict[str, Any]:
    def made(level: float) -> dict[str, Any]:
        return {"per_scale": {"flip": [[level, 0.9 * level, 1.1 * level]] * 5}}

    materials = {f"material {i}": made(level) for i, level in enumerate(levels)}
    return {"footprint_texels": [0.125, 0.5, 2.0, 8.0, 32.0], "materials": materials, "noise": made(0.001)}


def height_of_line(picture: bytes) -> float:
    """Row, as a share of the height, where the first line lies: of the default cycle's blue, not its pale interval."""
    with Image.open(io.BytesIO(picture)) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    # away from the legend's box, which has a short piece of it
    is_line = np.abs(pixels - [0x1F, 0x77, 0xB4]).max(axis=-1) < 12
    rows = np.flatnonzero(is_line.sum(axis=1) > 0.3 * pixels.shape[1])
    return rows.mean() / len(pixels)


def test_larger_errors_lie_higher():
    low, high = (height_of_line(scale_plot(report(level, 0.3))) for level in (0.1, 0.25))
    assert high < low


def test_the_same_report_gives_the_same_file():
    assert scale_plot(report(0.1, 0.2)) == scale_plot(report(0.1, 0.2))
    with pytest.raises(ValueError, match="metric is 'psnr'"):
        scale_plot(report(0.1), metric="psnr")
