"""jaxbrdf compare"""

from __future__ import annotations

import argparse
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, FOLDER_HELP, INPUT_HELP, add_command
from jaxbrdf.jobs.compare import compare
from jaxbrdf.report import text


def add_compare(commands: Any) -> None:
    """The command that judges a bundle."""
    command = add_command(commands, "compare", "judge a bundle against its reference", run_compare, text.comparison)
    command.add_argument("bundle", metavar="BUNDLE", help=BUNDLE_HELP)
    command.add_argument("input", metavar="INPUT|FOLDER", help=f"{INPUT_HELP}; or {FOLDER_HELP}")
    command.add_argument("--against", metavar="NBRDF.h5", help="a published network to be judged beside it")


def run_compare(options: argparse.Namespace) -> dict[str, Any]:
    """Judges the bundle."""
    return compare(options.bundle, options.input, against=options.against)
