"""Labels beside the points of a plot, where they cover neither each other nor a point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

POINT = 5.0
"""Half of the side of a point's place, in points."""

DISTANCES = (8.5, 12.5, 18.0, 26.0)
"""Between a point and its label, in points, the nearest tried first."""

AROUND = (0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180)
"""Degrees from the side that a label would like best."""

MARGIN = 2.0
"""Around each label, in points."""

HALO = (patheffects.withStroke(linewidth=2.0, foreground="white"),)


class Label(NamedTuple):
    """A text for a point.

    Attributes:
        x, y: of the point, data coordinates.
        text: to write.
        colour: of the text.
        side: where the label would like best to be, degrees from the x axis.
    """

    x: float
    y: float
    text: str
    colour: str
    side: float


def place_labels(axes: Axes, labels: Sequence[Label], points: Sequence[tuple[float, float]]) -> None:
    """Writes the labels, in their order, each at the first place that is free; one that finds none is left out.

    The figure's layout must be settled: call `figure.draw_without_rendering()` and switch its layout engine off.

    Args:
        axes: with its limits and scales set, on a figure with a canvas.
        labels: the more important first.
        points: all that no label may cover, data coordinates.
    """
    scale = axes.figure.dpi / 72.0
    centres = axes.transData.transform(np.asarray(points))
    taken = [Bbox([centre - POINT * scale, centre + POINT * scale]) for centre in centres]
    room = axes.get_window_extent()
    for label in labels:
        box = _write(axes, label, room, taken)
        taken += [] if box is None else [box]


def _write(axes: Axes, label: Label, room: Bbox, taken: Sequence[Bbox]) -> Bbox | None:
    """The label's box, or None if there was no place."""
    for distance in DISTANCES:
        for turn in AROUND:
            text = _annotation(axes, label, distance, np.radians(label.side + turn))
            box = text.get_window_extent().padded(MARGIN)
            if _is_within(box, room) and not any(box.overlaps(other) for other in taken):
                return box
            text.remove()
    return None


def _annotation(axes: Axes, label: Label, distance: float, angle: float) -> Annotation:
    cos, sin = np.cos(angle), np.sin(angle)
    sides = {-1: "right", 0: "center", 1: "left"}
    return axes.annotate(
        label.text,
        (label.x, label.y),
        xytext=(distance * cos, distance * sin),
        textcoords="offset points",
        ha=sides[round(cos)] if abs(cos) > 0.4 else "center",
        va="center" if abs(sin) < 0.9 else "bottom" if sin > 0 else "top",
        fontsize=8,
        color=label.colour,
        path_effects=HALO,
        arrowprops=None if distance < DISTANCES[2] else {"arrowstyle": "-", "color": label.colour, "lw": 0.6},
    )


def _is_within(box: Bbox, room: Bbox) -> bool:
    return box.x0 >= room.x0 and box.x1 <= room.x1 and box.y0 >= room.y0 and box.y1 <= room.y1
