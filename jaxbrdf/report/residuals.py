"""The picture of where a fit is off."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from jaxbrdf.metrics.residual_map import ResidualMap
from jaxbrdf.report.figure import to_png

SHOWN = 1.0
"""The residual at which colours end: a factor of e."""


def residual_picture(found: ResidualMap, *, title: str) -> bytes:
    """A PNG with the mean of the residuals, red where the fit is too bright, and their root mean square.

    Args:
        found: the map.
        title: above both.
    """
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    figure.suptitle(title)
    panels = (("mean", found.mean, "RdBu_r", -SHOWN), ("root mean square", found.root_mean_square, "viridis", 0.0))
    for axes, (name, values, colours, low) in zip(figure.subplots(1, 2, sharey=True), panels, strict=True):
        # even in the square root, like the cells
        mesh = axes.pcolormesh(
            found.theta_d, np.sqrt(found.theta_h), values, cmap=colours, vmin=low, vmax=SHOWN, rasterized=True
        )
        ticks = (0, 2, 5, 10, 20, 40, 60, 90)
        axes.set_yticks(np.sqrt(ticks), [str(tick) for tick in ticks])
        axes.set(xlabel="theta_d [degrees]", title=f"{name} of ln(fit / reference)")
        figure.colorbar(mesh, ax=axes, extend="both" if low else "max")
    figure.axes[0].set_ylabel("theta_h [degrees]")
    return to_png(figure)
