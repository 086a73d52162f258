"""A photographer's studio as an environment image, so that rendering needs no file."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Softbox(NamedTuple):
    """A soft-edged rectangular light.

    Attributes:
        azimuth, elevation: of its centre, in degrees; azimuth 0 is behind the viewer, positive to the viewer's right.
        width, height: in degrees.
        radiance: linear Rec.709.
    """

    azimuth: float
    elevation: float
    width: float
    height: float
    radiance: tuple[float, float, float]


SOFTBOXES = (
    Softbox(50.0, 40.0, 40.0, 50.0, (14.0, 13.0, 11.5)),
    Softbox(-65.0, 15.0, 20.0, 90.0, (4.0, 4.6, 5.6)),
    Softbox(160.0, 25.0, 50.0, 12.0, (9.0, 9.0, 9.0)),
    Softbox(-20.0, 70.0, 6.0, 6.0, (120.0, 115.0, 105.0)),
)
FLOOR, HORIZON, CEILING = (0.06, 0.055, 0.05), (0.25, 0.26, 0.28), (0.45, 0.48, 0.55)
EDGE = 2.0


def studio(*, height: int = 256) -> np.ndarray:
    """The image `(height, 2 height, 3)`, float32: a wall from floor to ceiling and four lights."""
    elevation = 90.0 - (np.arange(height) + 0.5) * 180.0 / height
    azimuth = 180.0 - (np.arange(2 * height) + 0.5) * 180.0 / height
    image = np.broadcast_to(_wall(elevation)[:, None], (height, 2 * height, 3)).copy()
    for box in SOFTBOXES:
        around = (azimuth - box.azimuth + 180.0) % 360.0 - 180.0
        cover = _inside(elevation - box.elevation, box.height)[:, None] * _inside(around, box.width)
        image += cover[..., None] * np.array(box.radiance)
    return image.astype(np.float32)


def _wall(elevation: np.ndarray) -> np.ndarray:
    """Colour by elevation `(n, 3)`: floor to horizon over 30 degrees, horizon to ceiling over 90."""
    stops = (-90.0, -30.0, 0.0, 90.0)
    return np.stack([np.interp(elevation, stops, c) for c in zip(FLOOR, FLOOR, HORIZON, CEILING, strict=True)], -1)


def _inside(offset: np.ndarray, extent: float) -> np.ndarray:
    """One within the extent, zero beyond, linear over the edge."""
    return np.clip((0.5 * extent - np.abs(offset)) / EDGE + 0.5, 0.0, 1.0)
