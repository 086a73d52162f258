"""jaxbrdf info"""

from __future__ import annotations

import argparse
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, FOLDER_HELP, INPUT_HELP, add_command
from jaxbrdf.jobs.info import info
from jaxbrdf.report import text


def add_info(commands: Any) -> None:
    """The command that describes a file."""
    command = add_command(commands, "info", "tell what a file is", run_info, text.fields)
    command.add_argument("file", metavar="FILE", help=f"{BUNDLE_HELP}; or {INPUT_HELP}; or {FOLDER_HELP}")


def run_info(options: argparse.Namespace) -> dict[str, Any]:
    """Describes the file."""
    return info(options.file)
