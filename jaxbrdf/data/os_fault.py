"""What the operating system refused, in a user's words."""

from __future__ import annotations

import errno

FAULTS = {
    errno.ENOENT: "there is no such file or folder",
    errno.EACCES: "permission denied",
    errno.EPERM: "permission denied",
    errno.EISDIR: "is a folder, not a file",
    errno.ENOTDIR: "a part of the path is a file, not a folder",
    errno.ENOSPC: "no space is left on the disk",
    errno.EDQUOT: "the disk quota is used up",
    errno.EROFS: "the file system is read-only",
    errno.ENAMETOOLONG: "the name is too long",
    errno.ELOOP: "its symbolic links run in a circle",
}


def os_fault(error: OSError) -> str:
    """One clause without a full stop that says what is wrong."""
    if error.errno in FAULTS:
        return FAULTS[error.errno]
    return error.strerror or "the operating system refused it without a reason"
