"""The failures a user can cause, each told in one line."""

from __future__ import annotations

from os import PathLike


class JaxbrdfError(Exception):
    """Anything a user can mend. The command line prints it as one line and exits with 2."""


class DataError(JaxbrdfError):
    """A file that cannot be read as what it claims to be: its path and the first wrong thing found."""

    def __init__(self, path: str | PathLike[str], fault: str):
        self.path, self.fault = str(path), fault
        super().__init__(f"{self.path}: {fault}")

    def __reduce__(self):
        return (DataError, (self.path, self.fault))


class FitError(JaxbrdfError):
    """A fit that diverged or cannot be resumed; the message names the checkpoint that was kept."""


class BudgetError(JaxbrdfError):
    """No candidate meets a budget; the message names the closest."""


class OpenCLError(JaxbrdfError):
    """No usable OpenCL device, or a program that the device's compiler refuses."""
