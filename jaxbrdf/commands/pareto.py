"""jaxbrdf pareto"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, INPUT_HELP, add_command, command_line, reporter_of
from jaxbrdf.commands.fit import add_recipe
from jaxbrdf.jobs.grid import GRIDS
from jaxbrdf.jobs.pareto import ParetoConfig, pareto, pareto_paths
from jaxbrdf.jobs.recipe import Recipe
from jaxbrdf.report import text


def add_pareto(commands: Any) -> None:
    """The command that sets candidates beside each other."""
    says = "compare models and sizes: their errors against what an evaluation costs"
    command = add_command(commands, "pareto", says, run_pareto, text.pareto)
    inputs = f"{INPUT_HELP}; or, judged by the first of these, {BUNDLE_HELP}"
    command.add_argument("inputs", nargs="+", metavar="INPUT", help=inputs)
    command.add_argument(
        "-o", "--output", required=True, metavar="FOLDER", help="for the tables, the plot and the fits"
    )
    command.add_argument("--grid", default="small", help=f"of candidates, one of {', '.join(GRIDS)} (default small)")
    add_recipe(command)


def run_pareto(options: argparse.Namespace) -> dict[str, Any]:
    """Fits, judges and times a grid; what an earlier run has fitted is taken as it is."""
    recipe = Recipe(options.preset, options.seed, options.budget_seconds)
    config = ParetoConfig(tuple(options.inputs), options.output, recipe, options.grid)
    paths = pareto_paths(config.output)
    try:
        results = pareto(config, reporter_of(options))
    except KeyboardInterrupt:
        if paths.bundles.exists():
            words = ["pareto", *config.inputs, "-o", config.output]
            again = command_line(words, {"grid": config.grid, **asdict(recipe)})
            print(f"what is fitted is kept; to go on:\n  {again}", file=sys.stderr)
        raise
    return {"files": {name: str(path) for name, path in paths._asdict().items()}, **results}
