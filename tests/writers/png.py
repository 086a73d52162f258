"""PNG files of any depth, by the format's description (ISO/IEC 15948): what libraries here cannot write."""

from __future__ import annotations

import struct
import zlib

import numpy as np

COLOUR_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}
ADAM7 = ((0, 0, 8, 8), (0, 4, 8, 8), (4, 0, 8, 4), (0, 2, 4, 4), (2, 0, 4, 2), (0, 1, 2, 2), (1, 0, 2, 1))
"""First row, first column, step of rows and of columns of each pass."""


def png(pixels: np.ndarray, *, interlaced: bool = False, palette: np.ndarray | None = None) -> bytes:
    """Integers `(H, W, 1 to 4)`, uint8 or uint16, as a file; with a palette `(N, 3)` they are its indices."""
    depth = 8 * pixels.dtype.itemsize
    kind = COLOUR_TYPES[pixels.shape[2]] if palette is None else 3
    head = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], depth, kind, 0, 0, interlaced)
    passes = [pixels[r::dr, c::dc] for r, c, dr, dc in ADAM7] if interlaced else [pixels]
    rows = b"".join(filtered(part) for part in passes if part.size)
    colours = b"" if palette is None else chunk(b"PLTE", palette.astype(np.uint8).tobytes())
    signature = b"\x89PNG\r\n\x1a\n"
    return signature + chunk(b"IHDR", head) + colours + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def chunk(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def filtered(pixels: np.ndarray) -> bytes:
    """Rows plain, as differences to the pixel on the left, and to the row above, in turn."""
    stored = np.frombuffer(np.ascontiguousarray(pixels, pixels.dtype.newbyteorder(">")).tobytes(), np.uint8)
    lines = stored.reshape(*pixels.shape[:2], -1)
    left, above = np.zeros_like(lines), np.zeros_like(lines)
    left[:, 1:], above[1:] = lines[:, :-1], lines[:-1]
    predicted = (np.zeros_like(lines), left, above)
    return b"".join(bytes([row % 3]) + (line - predicted[row % 3][row]).tobytes() for row, line in enumerate(lines))
