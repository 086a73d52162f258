"""What a device took long to find out, kept on disk by the digest of what it depends on.

A cache that cannot be read or written is no cache, and no fault.
"""

from __future__ import annotations

import contextlib
import hashlib
from pathlib import Path

import platformdirs

from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import DataError

DIGEST = hashlib.sha256().digest_size


def folder() -> Path:
    """Where the entries lie: the user's cache folder, as the system names it (XDG_CACHE_HOME on Linux)."""
    return Path(platformdirs.user_cache_dir("jaxbrdf")) / "opencl"


def key(*parts: str) -> str:
    """The name of the entry that depends on `parts`."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def read(name: str) -> bytes | None:
    """The entry's content, or None if there is none or it is not what was written."""
    try:
        content = (folder() / name).read_bytes()
    except OSError:
        return None
    digest, entry = content[:DIGEST], content[DIGEST:]
    return entry if hashlib.sha256(entry).digest() == digest else None


def write(name: str, entry: bytes) -> None:
    """Keeps the entry, where the disk allows it."""
    with contextlib.suppress(OSError, DataError):
        folder().mkdir(parents=True, exist_ok=True, mode=0o700)
        write_atomically(folder() / name, hashlib.sha256(entry).digest() + entry)
