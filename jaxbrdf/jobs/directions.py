"""The queries that a user hands to `jaxbrdf eval`: arrays `wi`, `wo` and perhaps `uv`, `footprint` in an .npz."""

from __future__ import annotations

import io
import math
import zipfile
from typing import NamedTuple
from zipfile import ZipFile

import numpy as np

from jaxbrdf.data import input as data_input
from jaxbrdf.errors import DataError

HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}

MOST_PER_BYTE = 1032
"""What deflate at most makes of one byte: a member that claims more would be found out only after it was allocated."""

MOST_OFF_ONE = 1e-3
"""Of a vector's length; single precision alone stays below 1e-6."""


class Queries(NamedTuple):
    """Arrays of an .npz file, float32.

    Attributes:
        wi, wo: unit vectors `(N, 3)`.
        uv: `(N, 2)`, or None where there is no such array.
        footprint: `(N, 2, 2)`, or None.
    """

    wi: np.ndarray
    wo: np.ndarray
    uv: np.ndarray | None
    footprint: np.ndarray | None


def read_queries(path: str) -> Queries:
    """The arrays `wi`, `wo`, `uv` and `footprint` of an .npz file, of which it may lack the last two.

    Raises:
        DataError: naming the first thing that is wrong.
    """
    content = data_input.read(path)
    if not content.startswith(b"PK"):
        raise DataError(path, "is not an .npz file")
    wi, wo = (_unit(path, name, _array(path, name, content)) for name in ("wi", "wo"))
    uv, footprint = (
        _checked(path, name, _array(path, name, content), shape) if _has(path, name, content) else None
        for name, shape in (("uv", (2,)), ("footprint", (2, 2)))
    )
    counts = {name: len(array) for name, array in Queries(wi, wo, uv, footprint)._asdict().items() if array is not None}
    if len(set(counts.values())) > 1:
        told = ", ".join(f"{name} {count}" for name, count in counts.items())
        raise DataError(path, f"its arrays have different lengths: {told}")
    if footprint is not None and uv is None:
        raise DataError(path, "has an array footprint, but no uv where it would lie")
    return Queries(wi, wo, uv, footprint)


def _has(path: str, name: str, content: bytes) -> bool:
    try:
        with ZipFile(io.BytesIO(content)) as archive:
            return f"{name}.npy" in archive.namelist()
    except zipfile.BadZipFile as error:
        raise DataError(path, f"is not an .npz file: {error}") from None


def _array(path: str, name: str, content: bytes) -> np.ndarray:
    try:
        with ZipFile(io.BytesIO(content)) as archive:
            if f"{name}.npy" not in archive.namelist():
                raise DataError(path, f"has no array {name}; wi and wo are needed")
            return _member(archive, archive.getinfo(f"{name}.npy"), len(content))
    except DataError:
        raise
    except Exception as error:  # the libraries raise whatever their parsers met
        reason = " ".join(str(error).split()) or type(error).__name__
        raise DataError(path, f"its array {name} cannot be read: {reason:.100}") from None


def _member(archive: ZipFile, member: zipfile.ZipInfo, size: int) -> np.ndarray:
    if member.file_size > MOST_PER_BYTE * size:
        raise ValueError(f"it claims {member.file_size} bytes in a file of {size}")
    content = archive.read(member)
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    if version not in HEADERS:
        raise ValueError(f"its format {version} is unknown")
    shape, _, dtype = HEADERS[version](stream)
    if math.prod(shape) * dtype.itemsize != len(content) - stream.tell():
        raise ValueError(f"its header claims the shape {shape} of {dtype}, which is not what follows")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)


def _checked(path: str, name: str, array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    if array.shape[1:] != shape or array.ndim == 0:
        wanted = ", ".join(["N", *map(str, shape)])
        raise DataError(path, f"{name} has shape {array.shape}, not ({wanted})")
    if array.dtype.kind != "f":
        raise DataError(path, f"{name} is {array.dtype}, not a floating-point array")
    if not np.isfinite(array).all():
        raise DataError(path, f"{name} is not finite")
    return array.astype(np.float32)


def _unit(path: str, name: str, array: np.ndarray) -> np.ndarray:
    checked = _checked(path, name, array, (3,))
    worst = np.abs(np.linalg.norm(array.astype(np.float64), axis=1) - 1.0).max(initial=0.0)
    if worst > MOST_OFF_ONE:
        raise DataError(path, f"{name} holds a vector whose length is {worst:.3g} off one")
    return checked
