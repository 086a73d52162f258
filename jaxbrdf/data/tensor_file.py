"""The RGL tensor container: named arrays behind a table of fields, all little-endian.

Layout: the twelve bytes `tensor_file\\0`, two version bytes (1, 0), the number of fields (uint32); then for each field
the length of its name (uint16), the name, its rank (uint16), its type (uint8), the position of its data (uint64) and
its shape (uint64 each).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from os import PathLike
from typing import NamedTuple

import numpy as np

from jaxbrdf.errors import DataError

MAGIC = b"tensor_file\0"
VERSION = (1, 0)
CODES = ("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8")
DTYPES = {code: np.dtype(name) for code, name in enumerate(CODES, start=1)}
"""The container's type codes: unsigned before signed, by size, then the floating-point types."""

MAX_RANK = 8
"""Above the rank of any known field (5); it keeps a corrupted rank from reading megabytes of shape."""


class Field(NamedTuple):
    """One entry of the table: where an array lies and what it is, before anything of it is read."""

    dtype: np.dtype
    offset: int
    shape: tuple[int, ...]


def read(content: bytes, path: str | PathLike[str]) -> Mapping[str, np.ndarray]:
    """The arrays of a tensor file by name, as read-only views of `content`.

    Raises:
        DataError: naming the first field whose description or data do not fit in the bytes at hand.
    """
    if content[: len(MAGIC)] != MAGIC:
        raise DataError(path, "not an RGL tensor file: it does not begin with 'tensor_file'")
    cursor = len(MAGIC)
    major, minor, count, cursor = _unpack(content, cursor, "<BBI", path)
    if (major, minor) != VERSION:
        raise DataError(path, f"tensor file version {major}.{minor} is not known, only 1.0")
    arrays, end = {}, cursor
    for number in range(count):
        name, field, cursor = _field(content, cursor, number, path)
        arrays[name] = _array(content, name, field, path)
        end = max(end, cursor, field.offset + arrays[name].nbytes)
    if end < len(content):
        raise DataError(path, f"{len(content) - end} bytes follow the last field")
    return arrays


def _unpack(content: bytes, cursor: int, layout: str, path) -> tuple:
    """The values of a struct layout at `cursor`, followed by the position after them."""
    end = cursor + struct.calcsize(layout)
    if end > len(content):
        raise DataError(path, f"the table of fields is cut off at byte {len(content)}")
    return (*struct.unpack_from(layout, content, cursor), end)


def _field(content: bytes, cursor: int, number: int, path) -> tuple[str, Field, int]:
    length, cursor = _unpack(content, cursor, "<H", path)
    raw, cursor = _unpack(content, cursor, f"<{length}s", path)
    rank, code, offset, cursor = _unpack(content, cursor, "<HBQ", path)
    name = raw.decode("latin-1").encode("unicode_escape").decode()
    if code not in DTYPES:
        raise DataError(path, f"field {number} ('{name}') has the unknown type code {code}")
    if rank > MAX_RANK:
        raise DataError(path, f"field {number} ('{name}') claims rank {rank}; at most {MAX_RANK} is known")
    *shape, cursor = _unpack(content, cursor, f"<{rank}Q", path)
    return name, Field(DTYPES[code], offset, tuple(shape)), cursor


def _array(content: bytes, name: str, field: Field, path) -> np.ndarray:
    count = math.prod(field.shape)
    if count == 0:
        raise DataError(path, f"field '{name}' {list(field.shape)} is empty")
    size = count * field.dtype.itemsize
    if field.offset + size > len(content):
        room = max(len(content) - field.offset, 0)
        raise DataError(path, f"field '{name}' {list(field.shape)} needs {size} bytes where {room} are left")
    return np.frombuffer(content, field.dtype, count, field.offset).reshape(field.shape)
