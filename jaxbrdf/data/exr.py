"""OpenEXR pictures, linear colours in half or single precision."""

from __future__ import annotations

import io
from os import PathLike

import numpy as np
import OpenEXR

from jaxbrdf.errors import DataError

MAGIC = b"\x76\x2f\x31\x01"
MOST_PIXELS = 2**28
"""16384 x 16384: what a header may claim before anything is allocated."""

MOST_PIXELS_PER_BYTE = 4096
"""Above what the format's compressions reach: deflate, the densest without loss, takes 1032 bytes into one."""

THREADS = 0
"""Decode on the calling thread: the pictures here are small, and worker threads would outlive the call."""


def read(content: bytes, path: str | PathLike[str]) -> np.ndarray:
    """The picture in the bytes of an `.exr` file, linear, float32, `(H, W, 3)`, the top row first.

    Channels R, G, B of the first part, or Y for grey; others are ignored.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    if content[:4] != MAGIC:
        raise DataError(path, "not an OpenEXR picture: its magic number is missing")
    _check_window(_open(content, path, header_only=True).header(), len(content), path)
    channels = _open(content, path, header_only=False).channels()
    names = ("R", "G", "B") if {"R", "G", "B"} <= channels.keys() else ("Y", "Y", "Y")
    if not set(names) <= channels.keys():
        raise DataError(path, f"has the channels {sorted(channels)}, but neither R, G, B nor Y")
    planes = [np.asarray(channels[name].pixels) for name in names]
    if any(plane.ndim != 2 or plane.shape != planes[0].shape for plane in planes):
        raise DataError(path, "its colour channels differ in size")
    picture = np.stack(planes, axis=-1).astype(np.float32)
    if not np.isfinite(picture).all():
        raise DataError(path, "a pixel is not finite")
    return picture


def write(picture: np.ndarray) -> bytes:
    """The bytes of an `.exr` file for linear colours `(H, W, 3)`: float16 stays half, all else becomes single.

    Raises:
        ValueError: if the picture has another shape or no pixels.
    """
    if picture.ndim != 3 or picture.shape[2] != 3 or picture.size == 0:
        raise ValueError(f"picture is {picture.shape}; should be (H, W, 3)")
    return write_planes({name: picture[..., i] for i, name in enumerate("RGB")})


def write_planes(planes: dict[str, np.ndarray]) -> bytes:
    """The bytes of an `.exr` file of named channels `(H, W)`: float16 stays half, all else becomes single.

    Raises:
        ValueError: if there is none, they differ in size or have no pixels.
    """
    shapes = {plane.shape for plane in planes.values()}
    if len(shapes) != 1 or any(len(shape) != 2 or 0 in shape for shape in shapes):
        raise ValueError(f"channels are of the shapes {sorted(shapes)}; should be of one (H, W)")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    stream = io.BytesIO()
    OpenEXR.File(header, {name: _stored(plane) for name, plane in planes.items()}, num_threads=THREADS).write(stream)
    return stream.getvalue()


def _stored(plane: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(plane, np.float16 if plane.dtype == np.float16 else np.float32)


def _open(content: bytes, path: str | PathLike[str], *, header_only: bool) -> OpenEXR.File:
    stream = io.BytesIO(content)
    try:
        file = OpenEXR.File(stream, separate_channels=True, header_only=header_only, num_threads=THREADS)
    except Exception as error:  # the library raises whatever its parser met
        raise DataError(path, f"cannot be decoded: {' '.join(str(error).split()) or type(error).__name__}") from None
    if not file.parts:
        raise DataError(path, "cannot be decoded: it holds no picture")
    return file


def _check_window(header: dict, size: int, path: str | PathLike[str]) -> None:
    low, high = (np.asarray(corner, np.int64) for corner in header["dataWindow"])
    width, height = (int(n) for n in high - low + 1)
    if min(width, height) < 1 or width * height > min(MOST_PIXELS, MOST_PIXELS_PER_BYTE * size):
        raise DataError(path, f"claims {height} x {width} pixels in {size} bytes")
