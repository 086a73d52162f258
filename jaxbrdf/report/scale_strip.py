"""Pictures of a surface from close by to far away, one row a material."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from jaxbrdf.metrics.image import auto_exposure, tonemap
from jaxbrdf.report.figure import to_png

INCHES, MARGIN = 1.4, 0.35
"""Of a picture's side, and of the names on the left: a share of the width would cut them off where scales are few."""


def scale_strip(rows: Mapping[str, np.ndarray], texels: np.ndarray, *, title: str) -> bytes:
    """A PNG with a row for each material and a column for each scale, exposed by the first row's pictures.

    Args:
        rows: linear Rec.709 pictures by name, `(scales, H, W, 3)`.
        texels: the length of a pixel's footprint at each scale, in texels.
        title: above them.
    """
    first = next(iter(rows.values()))
    exposures = [auto_exposure(picture) for picture in first]
    height, width = len(rows), len(first)
    size = (INCHES * width + MARGIN, INCHES * height + 0.7)
    figure = Figure(figsize=size, facecolor="black")
    grid = figure.subplots(height, width, squeeze=False)
    for axes_row, (name, pictures) in zip(grid, rows.items(), strict=True):
        for axes, picture, exposure in zip(axes_row, pictures, exposures, strict=True):
            axes.imshow(tonemap(picture, exposure), interpolation="nearest")
            axes.set_xticks([])
            axes.set_yticks([])
        axes_row[0].set_ylabel(name, color="white", fontsize=9)
    for axes, length in zip(grid[0], texels, strict=True):
        axes.set_title(f"{length:.3g} texels", color="white", fontsize=9)
    figure.suptitle(title, color="white", fontsize=10)
    figure.subplots_adjust(left=MARGIN / size[0], right=0.995, top=1.0 - 0.6 / size[1], bottom=0.01)
    return to_png(figure)
