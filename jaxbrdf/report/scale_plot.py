"""Errors of spatially varying materials over the size of a pixel's footprint (Timonen et al., Figure 4)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from jaxbrdf.report.figure import to_png

TITLES = {"flip": "FLIP", "ssim": "SSIM", "mae": "MAE, sRGB", "rmse": "RMSE, sRGB"}


def scale_plot(report: dict[str, Any], *, metric: str = "flip") -> bytes:
    """A PNG: the mean error at every scale with its interval, a line a material, and what the reference's noise makes.

    Args:
        report: as `jaxbrdf.jobs.planar_judge.planar_report` gives it.
        metric: flip, ssim, mae or rmse.

    Raises:
        ValueError: another metric.
    """
    if metric not in TITLES:
        raise ValueError(f"metric is {metric!r}; it must be one of {', '.join(TITLES)}")
    figure = Figure(figsize=(7.0, 4.4), dpi=120, layout="constrained", facecolor="white")
    axes, texels = figure.add_subplot(), report["footprint_texels"]
    for name, one in report["materials"].items():
        mean, low, high = np.transpose(one["per_scale"][metric])
        (line,) = axes.plot(texels, mean, label=name, linewidth=1.6)
        axes.fill_between(texels, low, high, color=line.get_color(), alpha=0.15, linewidth=0)
    noise = np.asarray(report["noise"]["per_scale"][metric])[:, 0]
    axes.plot(texels, noise, label="noise of the reference", color="#777777", linestyle=":", linewidth=1.2)
    axes.set_xscale("log", base=2)
    axes.set(xlabel="footprint of a pixel [texels]", ylabel=TITLES[metric])
    axes.grid(True, color="#e4e4e4", linewidth=0.6)
    axes.legend(frameon=False)
    return to_png(figure)
