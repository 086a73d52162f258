"""PNG pictures: 8 bits a channel, sRGB-encoded."""

from __future__ import annotations

import io
from os import PathLike

import numpy as np
from PIL import Image

from jaxbrdf.errors import DataError

MOST_PIXELS = 2**28
MODES = ("L", "LA", "P", "RGB", "RGBA")
"""Eight bits a channel; deeper ones would lose precision silently."""


def read(content: bytes, path: str | PathLike[str]) -> np.ndarray:
    """The encoded colours in the bytes of a PNG file, `(H, W, 3)` uint8, the top row first; alpha is dropped.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    try:
        with Image.open(io.BytesIO(content), formats=["PNG"]) as picture:
            _check(picture, path)
            return np.asarray(picture.convert("RGB"))
    except DataError:
        raise
    except Exception as error:  # the library raises whatever its parser met
        raise DataError(path, f"not a readable PNG picture: {' '.join(str(error).split())}") from None


def write(encoded: np.ndarray) -> bytes:
    """The bytes of a PNG file for sRGB-encoded colours `(H, W, 3)`, uint8 or in [0, 1].

    Raises:
        ValueError: if the picture has another shape, or holds what is no number.
    """
    if encoded.ndim != 3 or encoded.shape[2] != 3 or encoded.size == 0:
        raise ValueError(f"encoded is {encoded.shape}; should be (H, W, 3)")
    if np.isnan(encoded).any():
        raise ValueError("encoded has a pixel that is not a number")
    pixels = encoded if encoded.dtype == np.uint8 else np.rint(np.clip(encoded, 0.0, 1.0) * 255.0).astype(np.uint8)
    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(stream, "PNG")
    return stream.getvalue()


def _check(picture: Image.Image, path: str | PathLike[str]) -> None:
    width, height = picture.size
    if width * height > MOST_PIXELS:
        raise DataError(path, f"claims {height} x {width} pixels")
    if picture.mode not in MODES:
        raise DataError(path, f"its pixel format is '{picture.mode}', should have 8 bits a channel")
