"""jaxbrdf bench"""

from __future__ import annotations

import argparse
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, add_command
from jaxbrdf.jobs.bench import bench
from jaxbrdf.report import text


def add_bench(commands: Any) -> None:
    """The command that measures how fast a bundle is."""
    command = add_command(commands, "bench", "measure how fast OpenCL evaluates a bundle", run_bench, text.bench)
    command.add_argument("bundle", metavar="BUNDLE", help=BUNDLE_HELP)


def run_bench(options: argparse.Namespace) -> dict[str, Any]:
    """Times the bundle."""
    return bench(options.bundle)
