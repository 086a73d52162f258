"""Files that are there whole or not at all."""

from __future__ import annotations

import os
import secrets
from os import PathLike
from pathlib import Path

from jaxbrdf.data.os_fault import os_fault
from jaxbrdf.errors import DataError


def write_atomically(path: str | PathLike[str], content: bytes) -> None:
    """Writes `content` beside `path` and moves it there: a full disk or Ctrl-C leaves what was there before.

    A symbolic link keeps pointing where it did. A device or a pipe, such as /dev/null, cannot be replaced: it is
    written to.

    Raises:
        DataError: if it cannot be written.
    """
    try:
        target = Path(os.path.realpath(path))
        _refuse_folder(path, target)
        if target.exists() and not target.is_file():
            target.write_bytes(content)
        else:
            _replace(target, content)
    except (OSError, ValueError) as error:
        raise DataError(path, f"cannot be written: {_fault(error)}") from None


def check_writable(path: str | PathLike[str]) -> None:
    """Finds out before long work whether `write_atomically` will be able to write `path`; leaves no trace.

    Raises:
        DataError: if the path is a folder, or its folder is missing or refuses new files.
    """
    try:
        target = Path(os.path.realpath(path))
        _refuse_folder(path, target)
        if not target.parent.is_dir():
            raise DataError(path, f"cannot be written: the folder {target.parent} does not exist")
        if not target.exists() or target.is_file():
            _write_new(part := _part(target), b"")
            part.unlink()
    except (OSError, ValueError) as error:
        raise DataError(path, f"cannot be written: {_fault(error)}") from None


def _fault(error: OSError | ValueError) -> str:
    return os_fault(error) if isinstance(error, OSError) else str(error)


def _refuse_folder(path: str | PathLike[str], target: Path) -> None:
    if target.is_dir():
        raise DataError(path, "cannot be written: it is a folder, not a file")


def _part(target: Path) -> Path:
    """A name beside the target that nothing else has; short, so that a long name of the target's does not overflow."""
    return target.with_name(f".{secrets.token_hex(8)}.part")


def _replace(target: Path, content: bytes) -> None:
    part = _part(target)
    try:
        _write_new(part, content)
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)


def _write_new(path: Path, content: bytes) -> None:
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
