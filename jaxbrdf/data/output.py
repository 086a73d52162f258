"""Files that are there whole or not at all."""

from __future__ import annotations

import os
import secrets
from os import PathLike
from pathlib import Path

from jaxbrdf.errors import DataError


def write_atomically(path: str | PathLike[str], content: bytes) -> None:
    """Writes `content` beside `path` and moves it there: a full disk or Ctrl-C leaves what was there before.

    Raises:
        DataError: if it cannot be written.
    """
    target = Path(path)
    part = target.with_name(f".{secrets.token_hex(8)}.part")
    try:
        _write_durably(part, content)
        part.replace(target)
    except OSError as error:
        raise DataError(path, error.strerror or "cannot be written") from None
    finally:
        part.unlink(missing_ok=True)


def check_writable(path: str | PathLike[str]) -> None:
    """Finds out before long work whether `write_atomically` will be able to write `path`.

    Raises:
        DataError: if the path is a folder, or its folder is missing or refuses new files.
    """
    target = Path(path)
    if target.is_dir():
        raise DataError(path, "is a folder, not a file to write")
    probe = target.with_name(f".{secrets.token_hex(8)}.part")
    try:
        _write_durably(probe, b"")
    except OSError as error:
        raise DataError(path, f"cannot be written: {error.strerror}") from None
    finally:
        probe.unlink(missing_ok=True)


def _write_durably(path: Path, content: bytes) -> None:
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
