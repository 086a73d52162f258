"""Radiance pictures, `.hdr`: shared-exponent colours, plain or run-length encoded (Ward 1991)."""

from __future__ import annotations

import re
from os import PathLike

import numpy as np

from jaxbrdf.errors import DataError

FORMAT = b"32-bit_rle_rgbe"
RESOLUTION = re.compile(rb"([+-])([XY]) (\d+) ([+-])([XY]) (\d+)\s*$")
MOST_PIXELS_PER_BYTE = 64
"""Runs reach 16 pixels a byte; repeated runs of the old encoding more, but no picture is that empty."""

NEW_RUNS = range(8, 32768)
"""Widths that a scanline of the new encoding may have."""


def read(content: bytes, path: str | PathLike[str]) -> np.ndarray:
    """The picture in the bytes of an `.hdr` file, linear, float32, `(H, W, 3)`, the top row first.

    A mantissa m and an exponent e mean m 2^(e - 136); an EXPOSURE in the header is divided out.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    if not content.startswith((b"#?RADIANCE", b"#?RGBE")):
        raise DataError(path, "not a Radiance picture: it does not begin with '#?RADIANCE'")
    exposure, axes, start = _header(content, path)
    rows, columns = (axis[2] for axis in axes)
    if rows * columns > MOST_PIXELS_PER_BYTE * (len(content) - start) or rows * columns == 0:
        raise DataError(path, f"claims {rows} x {columns} pixels, but {len(content) - start} bytes follow")
    lines, cursor = [], start
    for _ in range(rows):
        line, cursor = _scanline(content, cursor, columns, path)
        lines.append(line)
    picture = _upright(np.stack(lines), axes)
    mantissa, exponent = picture[..., :3].astype(np.float32), picture[..., 3:].astype(np.int32)
    with np.errstate(over="ignore", under="ignore"):
        scaled = np.where(exponent > 0, np.ldexp(mantissa, exponent - 136), np.float32(0.0))
        linear = (scaled / exposure).astype(np.float32)
    if not np.isfinite(linear).all():
        raise DataError(path, "a pixel is not finite")
    return linear


def _header(content: bytes, path) -> tuple[float, tuple, int]:
    """The exposure, the two axes as (sign, letter, length), slowest first, and where the pixels begin."""
    cursor, exposure = 0, 1.0
    while True:
        end = content.find(b"\n", cursor, cursor + 4096)
        if end < 0:
            raise DataError(path, "the header is cut off")
        line, cursor = content[cursor:end].rstrip(b"\r"), end + 1
        if line == b"":
            break
        if line.startswith(b"FORMAT=") and line[7:].strip() != FORMAT:
            raise DataError(
                path, f"its format is '{line[7:].decode('ascii', 'replace')}', should be '{FORMAT.decode()}'"
            )
        if line.startswith(b"EXPOSURE="):
            exposure *= _number(line[9:], path)
    end = content.find(b"\n", cursor, cursor + 4096)
    found = RESOLUTION.match(content[cursor : max(end, cursor)])
    if not found or found[2] == found[5]:
        raise DataError(path, "the line with the resolution is missing or malformed")
    axes = (found[1], found[2], int(found[3])), (found[4], found[5], int(found[6]))
    return exposure, axes, end + 1


def _number(text: bytes, path) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < np.inf:
        raise DataError(path, f"the exposure '{text.decode('ascii', 'replace').strip()}' is not a positive number")
    return value


def _upright(picture: np.ndarray, axes: tuple) -> np.ndarray:
    """Rows from top to bottom, columns from left to right, whatever order the file has."""
    (first_sign, first, _), (second_sign, _, _) = axes
    if first == b"X":
        picture = picture.swapaxes(0, 1)
        first_sign, second_sign = second_sign, first_sign
    return picture[:: 1 if first_sign == b"-" else -1, :: 1 if second_sign == b"+" else -1]


def _scanline(content: bytes, cursor: int, width: int, path) -> tuple[np.ndarray, int]:
    """One line of `(width, 4)` bytes and the position after it."""
    head = content[cursor : cursor + 4]
    if len(head) < 4:
        raise DataError(path, "the pixels are cut off")
    if width in NEW_RUNS and head[:2] == b"\x02\x02" and head[2] < 128:
        if (head[2] << 8) + head[3] != width:
            raise DataError(path, f"a scanline claims {(head[2] << 8) + head[3]} pixels, should be {width}")
        return _separate_runs(content, cursor + 4, width, path)
    return _pixel_runs(content, cursor, width, path)


def _separate_runs(content: bytes, cursor: int, width: int, path) -> tuple[np.ndarray, int]:
    """The new encoding: each component by itself; a count above 128 repeats one byte, others copy."""
    line = np.empty((4, width), np.uint8)
    for component in line:
        place = 0
        while place < width:
            if cursor + 1 >= len(content):
                raise DataError(path, "the pixels are cut off")
            count = content[cursor]
            repeat = count > 128
            count = count - 128 if repeat else count
            values = content[cursor + 1 : cursor + 2 + (0 if repeat else count - 1)]
            if count == 0 or place + count > width or len(values) < (1 if repeat else count):
                raise DataError(path, "a run of pixels does not fit in its scanline")
            component[place : place + count] = np.frombuffer(values, np.uint8)
            place, cursor = place + count, cursor + 1 + len(values)
    return line.T, cursor


def _pixel_runs(content: bytes, cursor: int, width: int, path) -> tuple[np.ndarray, int]:
    """Plain pixels and the old encoding: the pixel (1, 1, 1, n) repeats the one before; further ones count in 256s."""
    line, place, shift = np.empty((width, 4), np.uint8), 0, 0
    while place < width:
        pixel = content[cursor : cursor + 4]
        if len(pixel) < 4:
            raise DataError(path, "the pixels are cut off")
        repeats = pixel[:3] == b"\1\1\1"
        count = pixel[3] << shift if repeats else 1
        if place + count > width or (repeats and place == 0) or shift > 24:
            raise DataError(path, "a run of pixels does not fit in its scanline")
        line[place : place + count] = line[place - 1] if repeats else np.frombuffer(pixel, np.uint8)
        place, cursor, shift = place + count, cursor + 4, shift + 8 if repeats else 0
    return line, cursor
