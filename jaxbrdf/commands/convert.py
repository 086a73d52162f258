"""jaxbrdf convert"""

from __future__ import annotations

import argparse
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, INPUT_HELP, add_command
from jaxbrdf.jobs.convert import convert
from jaxbrdf.report import text


def add_convert(commands: Any) -> None:
    """The command that resamples a material."""
    says = "resample a material into a MERL or UTIA file"
    command = add_command(commands, "convert", says, run_convert, text.written)
    command.add_argument("source", metavar="IN", help=f"{BUNDLE_HELP}; or {INPUT_HELP}")
    command.add_argument("output", metavar="OUT", help="a name ending in .binary (MERL) or .bin (UTIA)")


def run_convert(options: argparse.Namespace) -> dict[str, Any]:
    """Writes the table."""
    return {"output": str(convert(options.source, options.output))}
