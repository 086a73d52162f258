"""The MERL format (Matusik et al. 2003): isotropic tables over theta_h, theta_d and phi_d, `.binary`.

Three little-endian int32 (90, 90, 180), then three channels of doubles in that order, each to be multiplied by its
scale. Cell i of theta_h covers theta_h = (i / 90)^2 pi/2 to ((i + 1) / 90)^2 pi/2; theta_d and phi_d are evenly
divided, phi_d over [0, pi) since reciprocity gives the rest. A cell that was not measured, or is impossible, holds
negative numbers.
"""

from __future__ import annotations

import struct
from os import PathLike
from typing import NamedTuple

import numpy as np

from jaxbrdf.errors import DataError

SHAPE = (90, 90, 180)
CELLS = 90 * 90 * 180
HEADER = struct.Struct("<3i")
SIZE = HEADER.size + 3 * CELLS * 8
SCALE = np.array([1.0, 1.15, 1.66]) / 1500.0
INVALID = -1.0


class Merl(NamedTuple):
    """One material's table.

    Attributes:
        rgb: f in 1/sr, linear, no cosine, `(90, 90, 180, 3)` over theta_h, theta_d, phi_d; zero in invalid cells.
        valid: which cells hold a measurement, `(90, 90, 180)`.
    """

    rgb: np.ndarray
    valid: np.ndarray


def read(content: bytes, path: str | PathLike[str]) -> Merl:
    """The table in the bytes of a MERL `.binary` file.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    if len(content) < HEADER.size:
        raise DataError(path, f"has {len(content)} bytes, too few for a MERL header")
    dimensions = HEADER.unpack_from(content)
    if dimensions != SHAPE:
        raise DataError(path, f"not a MERL file: its dimensions are {list(dimensions)}, should be {list(SHAPE)}")
    if len(content) != SIZE:
        raise DataError(path, f"has {len(content)} bytes where a MERL file has {SIZE}")
    raw = np.frombuffer(content, "<f8", 3 * CELLS, HEADER.size).reshape(3, *SHAPE)
    _check(raw, path)
    rgb = np.moveaxis(raw, 0, -1) * SCALE
    valid = np.all(rgb >= 0, axis=-1)
    if not np.any(rgb[valid] > 0):
        raise DataError(path, "no valid cell is above zero")
    return Merl(np.where(valid[..., None], rgb, 0.0), valid)


def write(table: Merl) -> bytes:
    """The bytes of a MERL file; invalid cells become -1.

    Raises:
        ValueError: if the table's shape is not MERL's, or a valid cell is not finite or negative.
    """
    rgb = np.asarray(table.rgb, np.float64)
    if rgb.shape != (*SHAPE, 3) or table.valid.shape != SHAPE:
        raise ValueError(
            f"table.rgb is {rgb.shape} and table.valid {table.valid.shape}; should be {(*SHAPE, 3)}, {SHAPE}"
        )
    if not np.all(np.isfinite(rgb[table.valid]) & (rgb[table.valid] >= 0)):
        raise ValueError("table.rgb has a valid cell that is negative or not finite; mark it invalid")
    raw = np.where(table.valid[..., None], rgb / SCALE, INVALID)
    return HEADER.pack(*SHAPE) + np.ascontiguousarray(np.moveaxis(raw, -1, 0), "<f8").tobytes()


def _check(raw: np.ndarray, path: str | PathLike[str]) -> None:
    finite = np.abs(raw) <= np.finfo(np.float32).max
    if not finite.all():
        channel, *cell = (int(i) for i in np.unravel_index(int(np.argmin(finite)), raw.shape))
        raise DataError(path, f"cell {cell} of channel {channel} is not finite")
