"""Pictures of any kind that textures come in: PNG and JPEG, OpenEXR and Radiance, told apart by their first bytes."""

from __future__ import annotations

import io
from os import PathLike
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageFile

from jaxbrdf.data import exr, hdr
from jaxbrdf.data.png import MOST_PIXELS
from jaxbrdf.errors import DataError

INTEGER_FORMATS = {b"\x89PNG\r\n\x1a\n": "PNG", b"\xff\xd8\xff": "JPEG"}
GREY_MODES = ("1", "L", "LA")
COLOUR_MODES = ("P", "RGB", "RGBA")

DEEP = {"RGB;16B": ("RGB;16B", "RGB;16L"), "RGBA;16B": ("RGBA;16B", "RGBA;16L")}
"""Pillow's layouts of PNG's 16-bit colours. It keeps eight bits of them, and which is a matter of the layout that it is
told: the file's own gives the upper byte of each number, the one of the other byte order the lower."""

DEEP_GREY_ALPHA = "LA;16B"
"""Grey and alpha of 16 bits, which four plain bytes can hold, so that one pass is enough."""


class Picture(NamedTuple):
    """The values of a picture file, alpha dropped.

    Attributes:
        values: float32, `(H, W, 1)` for grey or `(H, W, 3)`, the top row first. What was stored in 8 or 16 bits is in
            [0, 1], the largest integer being 1.
        integer: whether they were stored as integers, in which colours are encoded, rather than as linear floats.
    """

    values: np.ndarray
    integer: bool


def read(content: bytes, path: str | PathLike[str]) -> Picture:
    """The picture in the bytes of a PNG, JPEG, OpenEXR or Radiance file. Colour profiles are not looked at.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    if content[:4] == exr.MAGIC:
        return Picture(exr.read(content, path), integer=False)
    if content.startswith(b"#?"):
        return Picture(hdr.read(content, path), integer=False)
    for magic, kind in INTEGER_FORMATS.items():
        if content.startswith(magic):
            return Picture(_integers(content, kind, path), integer=True)
    raise DataError(path, "not a PNG, JPEG, OpenEXR or Radiance picture, by its first bytes")


def _integers(content: bytes, kind: str, path: str | PathLike[str]) -> np.ndarray:
    """Integers over the largest that their type has, `(H, W, 1 or 3)`."""
    try:
        with _open(content, kind, path) as picture:
            stored = _stored(picture, content, kind, path)
    except DataError:
        raise
    except Exception as error:  # the library raises whatever its parser met
        raise DataError(path, f"not a readable {kind} picture: {' '.join(str(error).split())}") from None
    planes = stored if stored.ndim == 3 else stored[..., None]
    return (planes / np.float32(np.iinfo(stored.dtype).max)).astype(np.float32)


def _open(content: bytes, kind: str, path: str | PathLike[str]) -> ImageFile.ImageFile:
    picture = Image.open(io.BytesIO(content), formats=[kind])
    width, height = picture.size
    if width * height > MOST_PIXELS:
        raise DataError(path, f"claims {height} x {width} pixels")
    return picture


def _stored(picture: ImageFile.ImageFile, content: bytes, kind: str, path: str | PathLike[str]) -> np.ndarray:
    layout = picture.tile[0].args if kind == "PNG" and picture.tile else None
    if layout in DEEP:
        upper, lower = (_unpacked(content, kind, other) for other in DEEP[layout])
        return (upper[..., :3].astype(np.uint16) << 8) | lower[..., :3]
    if layout == DEEP_GREY_ALPHA:
        return np.ascontiguousarray(_unpacked(content, kind, "RGBA")[..., :2]).view(">u2").astype(np.uint16)
    if picture.mode.startswith("I;16"):
        return np.asarray(picture).astype(np.uint16)
    if picture.mode in GREY_MODES:
        return np.asarray(picture.convert("L"))
    if picture.mode in COLOUR_MODES:
        # by way of alpha, which a palette may have: Pillow warns where it would be lost
        return np.asarray(picture.convert("RGBA"))[..., :3]
    raise DataError(path, f"its pixel format is '{picture.mode}', should be grey or RGB")


def _unpacked(content: bytes, kind: str, layout: str) -> np.ndarray:
    """The bytes that Pillow unpacks from its file's rows when it is told that they have this layout."""
    with Image.open(io.BytesIO(content), formats=[kind]) as picture:
        picture.tile = [tile._replace(args=layout) for tile in picture.tile]
        return np.asarray(picture)
