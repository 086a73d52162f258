"""Tangent-space normal maps: decoding, whether a picture looks like one, and which way its green points.

OpenGL's convention has green grow where the normal leans up the picture, DirectX's where it leans down. The slopes of
a surface, p = -nx/nz and q = -ny/nz, are the gradient of its height, so that dp/dv = dq/du; with green the wrong way
round, dp/dv = -dq/du is found instead. What is left of the curl under both hypotheses decides, by the ratio

    residual = mean (dp/dv - dq/du)^2 / mean (dp/dv + dq/du)^2,

below 1 for OpenGL. The nine sets that the tests read have

    Bricks102 0.056, Metal049A 0.632, cobblestone_floor_08 0.072, fabric_pattern_07 0.316, which say OpenGL by name;
    Facade005 0.039, Metal053C 0.126, Metal055A 0.212, Onyx003 0.485, Rock058 0.035, which do not say,

and with green flipped each has the inverse.
"""

from __future__ import annotations

import math
from os import PathLike
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

from jaxbrdf.data.texture_name import Convention
from jaxbrdf.errors import DataError

FLAT = (0.0, 0.0, 1.0)

UNIT = (0.5, 1.5)
"""Lengths that quantisation and JPEG leave a unit vector with: 99.8% of each set's texels lie in 0.501 to 1.11."""

MOST_OFF = 0.05
"""Share of texels beside `UNIT` or that face inwards. The sets have 0.001 at most (dark crevices, blurred by JPEG);
their other maps, read as normals, 0.57 and more, but for light grey ones, which `MOST_TILT` tells."""

MOST_TILT = 0.3
"""Tangential part of the mean normal, which is near zero for what is flat at large. The sets have 0.05 at most; light
grey pictures, of which every texel is near a unit vector, lean towards (1, 1, 1) with about 0.8."""

SMOOTHING = 1.0
"""Standard deviation in texels of a blur before slopes are differentiated: JPEG's noise is mostly finer than that."""

STEEPEST = 0.1
"""Least nz that slopes are taken from: those beyond 84 degrees would outweigh the rest."""

DECISIVE = 0.8
"""A residual between this and its inverse decides nothing. The largest of the nine is 0.632. Compressed anew at quality
75, three of them lose what tells, and give up to 1.024; the largest that 128 x 128 texels of any give is 1.07."""

DECISIVE_SIDE = 18.0
"""|ln residual| must exceed this over sqrt(texels), too. For white noise its standard deviation is 3 / sqrt(texels),
and slopes are correlated over further than noise: 32 x 32 texels of one set give 1.23."""

LEAST_CURL = 1e-12
"""Mean square of rounding: slopes of 1 have 6e-8 in single precision, so that what is below is no curl."""

LEVEL = 4.0 / 255.0
"""|ny| of a normal whose green says nothing: 8 bits have no 1/2, so that flat ones are off by 1/255; JPEG adds some."""


class NormalMap(NamedTuple):
    """A decoded normal map.

    Attributes:
        normals: unit vectors `(H, W, 3)`, float32: x to the right, y up the picture, z out.
        off: how many texels were not near a unit vector that faces out. They were taken by their direction where that
            faces out, else as flat.
    """

    normals: np.ndarray
    off: int


def decode(encoded: np.ndarray, path: str | PathLike[str]) -> NormalMap:
    """Normals by OpenGL's convention from values `(H, W, 3)` in [0, 1], of which 1/2 is zero.

    Raises:
        DataError: if the picture does not look like a normal map.
    """
    if encoded.shape[2] != 3:
        raise DataError(path, "does not look like a normal map: it is grey")
    # floats may be anything: where they are no normals they are still not to overflow
    raw = 2.0 * np.clip(encoded, -1.0, 2.0) - 1.0
    length = np.linalg.norm(raw, axis=-1, keepdims=True)
    off = _off(raw, length, path)
    outward = (raw[..., 2:] > 0.0) & (length > 1e-3)
    normals = np.where(outward, raw / np.where(outward, length, 1.0), np.asarray(FLAT, np.float32))
    tilt = float(np.hypot(*normals.mean(axis=(0, 1), dtype=np.float64)[:2]))
    if tilt > MOST_TILT:
        raise DataError(path, f"does not look like a normal map: on average its normals lean by {tilt:.2f}")
    return NormalMap(normals, off)


def flipped(normals: np.ndarray) -> np.ndarray:
    """Normals `(H, W, 3)` with y the other way: from one convention to the other."""
    return normals * np.asarray([1.0, -1.0, 1.0], np.float32)


def residual(normals: np.ndarray) -> float:
    """Mean square of the curl that `normals` `(H, W, 3)` have, over that with y flipped; 1 where there is none."""
    if min(normals.shape[:2]) < 3:
        return 1.0
    smooth = [gaussian_filter(normals[..., i], SMOOTHING) for i in range(3)]
    p, q = (-component / np.maximum(smooth[2], STEEPEST) for component in smooth[:2])
    # v runs up, rows run down
    dp_dv, dq_du = p[:-2, 1:-1] - p[2:, 1:-1], q[1:-1, 2:] - q[1:-1, :-2]
    kept, turned = (float(np.mean(np.square(curl), dtype=np.float64)) for curl in (dp_dv - dq_du, dp_dv + dq_du))
    return max(kept, LEAST_CURL) / max(turned, LEAST_CURL)


def convention(opengl: np.ndarray, ratio: float) -> Convention | None:
    """The convention of a map, decoded by OpenGL's to `(H, W, 3)` of the residual `ratio`; None where nothing tells.

    Where nothing tells but no normal leans up or down, both conventions are the same, and it is called OpenGL's.
    """
    told = -math.log(ratio)
    if abs(told) < max(-math.log(DECISIVE), DECISIVE_SIDE / math.sqrt(opengl[..., 0].size)):
        return "opengl" if np.abs(opengl[..., 1]).max() <= LEVEL else None
    return "opengl" if told > 0.0 else "directx"


def _off(raw: np.ndarray, length: np.ndarray, path: str | PathLike[str]) -> int:
    low, high = UNIT
    wrong = (length < low) | (length > high) | (raw[..., 2:] <= 0.0)
    if wrong.mean() > MOST_OFF:
        share = f"{wrong.mean():.0%} of its texels"
        raise DataError(path, f"does not look like a normal map: {share} are no unit vectors that face out")
    return int(wrong.sum())
