"""The UTIA BRDF database's format (Filip and Vavra 2014): anisotropic tables, `.bin`.

Doubles, little-endian, without a header: three colour planes of 288 rows (theta_i, phi_i) by 288 columns (theta_v,
phi_v), azimuth fastest; theta = 0, 15, ... 75 degrees, phi = 0, 7.5, ... 352.5. i is the light (our wi), v the viewer
(our wo). Values are taken as f without a cosine, in linear RGB, as the database's own reading code uses them; the files
do not state a unit, and their absolute scale is the database's.
"""

from __future__ import annotations

from os import PathLike
from typing import NamedTuple

import numpy as np

from jaxbrdf.errors import DataError

THETAS = 6
PHIS = 48
SHAPE = (THETAS, PHIS, THETAS, PHIS)
CELLS = (THETAS * PHIS) ** 2
SIZES = {3 * CELLS * 8: np.dtype("<f8"), 3 * CELLS * 4: np.dtype("<f4")}
"""The published files are doubles; the same table in single precision is told by its size alone."""


class Utia(NamedTuple):
    """One material's table.

    Attributes:
        rgb: f, `(6, 48, 6, 48, 3)` over theta_i, phi_i, theta_v, phi_v; may be slightly negative.
    """

    rgb: np.ndarray


def read(content: bytes, path: str | PathLike[str]) -> Utia:
    """The table in the bytes of a UTIA `.bin` file.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    if len(content) not in SIZES:
        sizes = " or ".join(str(size) for size in SIZES)
        raise DataError(path, f"has {len(content)} bytes where a UTIA file has {sizes}")
    planes = np.frombuffer(content, SIZES[len(content)]).reshape(3, *SHAPE)
    finite = np.abs(planes) <= np.finfo(np.float32).max
    if not finite.all():
        plane, *cell = (int(i) for i in np.unravel_index(int(np.argmin(finite)), planes.shape))
        raise DataError(path, f"cell {cell} of plane {plane} is not finite")
    if not np.any(planes > 0):
        raise DataError(path, "no cell is above zero")
    return Utia(np.moveaxis(planes, 0, -1).astype(np.float64))


def write(table: Utia) -> bytes:
    """The bytes of a UTIA file, in doubles.

    Raises:
        ValueError: if the table's shape is not UTIA's, or a cell is not finite.
    """
    if table.rgb.shape != (*SHAPE, 3):
        raise ValueError(f"table.rgb is {table.rgb.shape}; should be {(*SHAPE, 3)}")
    if not np.isfinite(table.rgb).all():
        raise ValueError("table.rgb has a cell that is not finite")
    return np.ascontiguousarray(np.moveaxis(table.rgb, -1, 0), "<f8").tobytes()
