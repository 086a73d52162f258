"""jaxbrdf stability"""

from __future__ import annotations

import argparse
from typing import Any

from jaxbrdf.commands.command import INPUT_HELP, add_command, reporter_of
from jaxbrdf.jobs.stability import stability
from jaxbrdf.report import text


def add_stability(commands: Any) -> None:
    """The command that checks a material."""
    says = "check a bundle or a material: values, derivatives, energy, sampler, kernel"
    command = add_command(commands, "stability", says, run_stability, text.stability)
    command.add_argument("input", metavar="BUNDLE|INPUT", help=f"a .safetensors bundle or its folder, or {INPUT_HELP}")
    command.set_defaults(exit_code=lambda result: int(result["failed"] > 0))


def run_stability(options: argparse.Namespace) -> dict[str, Any]:
    """Checks the material."""
    return stability(options.input, reporter_of(options))
