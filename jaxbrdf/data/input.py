"""The bytes of an input, from a file or from a member of a ZIP archive."""

from __future__ import annotations

import io
import zipfile
import zlib
from os import PathLike
from pathlib import Path

from jaxbrdf.data.os_fault import os_fault
from jaxbrdf.errors import DataError

MOST_BYTES = 2**31
"""Two GiB: several times the largest published measurement."""


def read(path: str | PathLike[str]) -> bytes:
    """The whole content of a file; `archive.zip/name` means a member, by its full name or its last part.

    Raises:
        DataError: there is no such file, or it is a folder, empty, unreadable, no regular file, or above `MOST_BYTES`.
    """
    path = Path(path)
    archive = _archive(path)
    content = _read_file(path) if archive is None else _read_member(path, archive)
    if not content:
        raise DataError(path, "the file is empty")
    return content


def _archive(path: Path) -> Path | None:
    """The part of the path that is a ZIP archive, if it goes on behind one."""
    parents = [parent for parent in path.parents if parent.suffix == ".zip"]
    return next((parent for parent in parents if parent.is_file()), None)


def _read_file(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise DataError(path, "is a folder, not a file")
        if path.exists() and not path.is_file():
            raise DataError(path, "is neither a file nor a folder")
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise DataError(path, os_fault(error)) from None
    except (ValueError, MemoryError) as error:
        raise DataError(path, str(error) or "does not fit in memory") from None
    return _limited(path, content)


def _limited(path: Path, content: bytes) -> bytes:
    if len(content) > MOST_BYTES:
        raise DataError(path, f"is larger than {MOST_BYTES} bytes, more than any known measurement")
    return content


def _read_member(path: Path, archive: Path) -> bytes:
    wanted = path.relative_to(archive).as_posix()
    try:
        with zipfile.ZipFile(io.BytesIO(_read_file(archive))) as members:
            names = [name for name in members.namelist() if name == wanted or name.rsplit("/", 1)[-1] == wanted]
            if not names:
                raise DataError(path, f"the archive has no member '{wanted}'")
            with members.open(names[0]) as file:
                return _limited(path, file.read(MOST_BYTES + 1))
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        raise DataError(path, f"the archive cannot be read: {error}") from None
