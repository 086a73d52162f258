"""jaxbrdf eval"""

from __future__ import annotations

import argparse
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, INPUT_HELP, add_command
from jaxbrdf.jobs.evaluate import BACKENDS, evaluate
from jaxbrdf.report import text


def add_eval(commands: Any) -> None:
    """The command that evaluates a material."""
    command = add_command(commands, "eval", "evaluate a material at given directions", run_eval, text.written)
    command.add_argument("source", metavar="BUNDLE|INPUT", help=f"{BUNDLE_HELP}; or {INPUT_HELP}")
    command.add_argument("--directions", required=True, metavar="DIRS.npz", help="arrays wi and wo, float32 (N, 3)")
    command.add_argument("-o", "--output", required=True, metavar="VALUES.npy", help="f, float32 (N, 3)")
    command.add_argument("--backend", choices=BACKENDS, default="jax", help="opencl is for bundles")


def run_eval(options: argparse.Namespace) -> dict[str, Any]:
    """Writes the values."""
    queries = evaluate(options.source, options.directions, options.output, backend=options.backend)
    return {"output": options.output, "queries": queries, "backend": options.backend}
