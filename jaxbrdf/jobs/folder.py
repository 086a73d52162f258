"""Folders that a command writes into."""

from __future__ import annotations

from pathlib import Path

from jaxbrdf.data.os_fault import os_fault
from jaxbrdf.errors import DataError


def make_folder(folder: Path) -> None:
    """Makes the folder and those that it lies in, as far as they are not there.

    Raises:
        DataError: if it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise DataError(folder, "is a file, not a folder to write into") from None
    except OSError as error:
        raise DataError(folder, f"cannot be made a folder: {os_fault(error)}") from None
