"""The directions that a user hands to `jaxbrdf eval`: arrays `wi` and `wo` in an .npz file."""

from __future__ import annotations

import io
import math
import zipfile
from zipfile import ZipFile

import numpy as np

from jaxbrdf.data import input as data_input
from jaxbrdf.errors import DataError

HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}

MOST_PER_BYTE = 1032
"""What deflate at most makes of one byte: a member that claims more would be found out only after it was allocated."""

MOST_OFF_ONE = 1e-3
"""Of a vector's length; single precision alone stays below 1e-6."""


def read_directions(path: str) -> tuple[np.ndarray, np.ndarray]:
    """The arrays `wi` and `wo` of an .npz file, float32 `(N, 3)` unit vectors.

    Raises:
        DataError: naming the first thing that is wrong.
    """
    content = data_input.read(path)
    if not content.startswith(b"PK"):
        raise DataError(path, "is not an .npz file")
    wi, wo = (_checked(path, name, _array(path, name, content)) for name in ("wi", "wo"))
    if wi.shape != wo.shape:
        raise DataError(path, f"wi is {wi.shape} and wo {wo.shape}; they must be the same")
    return wi, wo


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


def _checked(path: str, name: str, array: np.ndarray) -> np.ndarray:
    if array.ndim != 2 or array.shape[1] != 3:
        raise DataError(path, f"{name} has shape {array.shape}, not (N, 3)")
    if array.dtype.kind != "f":
        raise DataError(path, f"{name} is {array.dtype}, not a floating-point array")
    if not np.isfinite(array).all():
        raise DataError(path, f"{name} is not finite")
    worst = np.abs(np.linalg.norm(array.astype(np.float64), axis=1) - 1.0).max(initial=0.0)
    if worst > MOST_OFF_ONE:
        raise DataError(path, f"{name} holds a vector whose length is {worst:.3g} off one")
    return array.astype(np.float32)
