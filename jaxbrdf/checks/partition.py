"""Ways to cut the sphere into cells, each the image of a regular grid in the unit square.

A chi-square test is only as sharp as its cells: about a lobe of width 1e-4 a regular grid of angles sees one full cell.
These maps spread such lobes out. They are written in numpy and float64, apart from the code they help to judge.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Partition(NamedTuple):
    """A map between the unit square and directions.

    Attributes:
        place: points `(n, 2)` to unit vectors `(n, 3)` and the solid angle per unit of area there, `(n,)`.
        locate: unit vectors `(n, 3)` back to points `(n, 2)`.
    """

    place: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    locate: Callable[[np.ndarray], np.ndarray]


def polar(*, axis: tuple[float, float, float] = (0.0, 0.0, 1.0), spread: float = 1.0) -> Partition:
    """Rings and sectors about `axis`, the rings widening geometrically from `spread` radians on.

    With t = 1 - cos(angle to the axis) and e = spread^2, the first coordinate is log(1 + t / e) / log(1 + 2 / e).
    """
    frame, squared = _frame(axis), spread**2
    log = np.log1p(2.0 / squared)

    def place(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        t = squared * np.expm1(points[:, 0] * log)
        sin, phi = np.sqrt(np.maximum(t * (2.0 - t), 0.0)), 2.0 * np.pi * points[:, 1]
        local = np.stack([sin * np.cos(phi), sin * np.sin(phi), 1.0 - t], axis=-1)
        return local @ frame, 2.0 * np.pi * log * (t + squared)

    def locate(w: np.ndarray) -> np.ndarray:
        # 1 - cos = |w - axis|^2 / 2 keeps its digits next to the axis.
        t = 0.5 * np.square(w - frame[2]).sum(-1)
        turn = np.arctan2(w @ frame[1], w @ frame[0]) / (2.0 * np.pi)
        return np.stack([np.log1p(t / squared) / log, turn % 1.0], axis=-1)

    return Partition(place, locate)


def half_vector(wo: tuple[float, float, float], alpha_x: float, alpha_y: float) -> Partition:
    """Mirror images of wo about half vectors whose slopes are spread like a microfacet lobe's of that roughness.

    With T = diag(alpha_x, alpha_y, 1) and m uniform over the hemisphere, wh = T m / |T m|, d wh = det T / |T m|^3 d m,
    and d wi = 4 |wo . wh| d wh.
    """
    view, scale = np.asarray(wo, np.float64), np.array([alpha_x, alpha_y, 1.0])

    def place(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z, phi = 1.0 - points[:, 0], 2.0 * np.pi * points[:, 1]
        sin = np.sqrt(1.0 - z * z)
        stretched = np.stack([sin * np.cos(phi), sin * np.sin(phi), z], axis=-1) * scale
        length = np.linalg.norm(stretched, axis=-1)
        wh = stretched / length[:, None]
        facing = wh @ view
        area = 2.0 * np.pi * alpha_x * alpha_y / length**3 * 4.0 * np.maximum(facing, 0.0)
        return 2.0 * facing[:, None] * wh - view, area

    def locate(w: np.ndarray) -> np.ndarray:
        m = (w + view) / scale
        m /= np.linalg.norm(m, axis=-1, keepdims=True)
        return np.stack([1.0 - m[:, 2], np.arctan2(m[:, 1], m[:, 0]) / (2.0 * np.pi) % 1.0], axis=-1)

    return Partition(place, locate)


def _frame(axis: tuple[float, float, float]) -> np.ndarray:
    """Orthonormal rows: a tangent, a bitangent and the axis."""
    z = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


BROAD = 0.5
"""Distance within which a broad lobe has less than a quarter of its draws; it is 0.7 for uniform ones."""


def partition_around(drawn: np.ndarray, wo: ArrayLike) -> Partition:
    """Rings about where most of the directions `drawn`, `(n, 3)`, lie, as narrow as the closest quarter of them.

    The middle is the mirrored viewer or the median, whichever more of them crowd about. Of a broad lobe even rings
    about the normal: none crosses the horizon, where its density may jump.
    """
    mirror = np.asarray(wo, np.float64) * [-1.0, -1.0, 1.0]
    middle = np.median(drawn, axis=0)
    axes = [mirror, middle / np.linalg.norm(middle)]
    nearness = [np.quantile(np.linalg.norm(drawn - axis, axis=-1), 0.25) for axis in axes]
    best = int(np.argmin(nearness))
    if nearness[best] > BROAD:
        return polar(spread=100.0)
    return polar(axis=tuple(axes[best]), spread=float(np.clip(nearness[best], 1e-4, 1.0)))
