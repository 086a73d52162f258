"""Pictures for a reader: a fit beside its reference."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from jaxbrdf.metrics.image import auto_exposure, tonemap
from jaxbrdf.report.figure import to_png

DIFFERENCE_GAIN = 5.0


def side_by_side(fit: np.ndarray, reference: np.ndarray, *, title: str, note: str) -> bytes:
    """A PNG with reference, fit and five times their absolute difference, all after the same exposure and sRGB
    encoding.

    Args:
        fit, reference: linear Rec.709 `(H, W, 3)`.
        title: above the middle picture.
        note: below it, such as the errors.
    """
    exposure = auto_exposure(reference)
    shown, wanted = tonemap(fit, exposure), tonemap(reference, exposure)
    difference = np.clip(DIFFERENCE_GAIN * np.abs(shown - wanted), 0.0, 1.0)
    panels = {"reference": wanted, title: shown, f"{DIFFERENCE_GAIN:.0f} x |difference|": difference}
    return in_a_row(panels, note=note)


def in_a_row(panels: Mapping[str, np.ndarray], *, note: str) -> bytes:
    """A PNG of pictures beside each other.

    Args:
        panels: sRGB pictures `(H, W, 3)` in [0, 1] by their titles.
        note: below the middle.
    """
    figure = Figure(figsize=(3.0 * len(panels), 3.4), facecolor="black")
    for axes, (name, image) in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels.items(), strict=True):
        axes.imshow(image, interpolation="nearest")
        axes.set_title(name, color="white", fontsize=10)
        axes.set_axis_off()
    figure.text(0.5, 0.03, note, color="white", ha="center", fontsize=9)
    figure.subplots_adjust(left=0.01, right=0.99, top=0.9, bottom=0.08, wspace=0.02)
    return to_png(figure)
