"""jaxbrdf pareto"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, INPUT_HELP, add_command, command_line, reporter_of
from jaxbrdf.commands.fit import SURFACE_OPTIONS, add_recipe, add_surface, refuse, surface_config
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.jobs.grid import GRIDS
from jaxbrdf.jobs.pareto import ParetoConfig, pareto, pareto_paths
from jaxbrdf.jobs.recipe import Recipe
from jaxbrdf.jobs.source import is_texture_folder
from jaxbrdf.jobs.surface_pareto import SurfaceParetoConfig, surface_pareto
from jaxbrdf.report import text

DEFAULT_GRID = "small"


def add_pareto(commands: Any) -> None:
    """The command that sets candidates beside each other."""
    says = "compare models and sizes: their errors against what an evaluation costs"
    command = add_command(commands, "pareto", says, run_pareto, text.pareto)
    inputs = f"{INPUT_HELP}; or one folder of PBR textures; and, judged by the first of these, {BUNDLE_HELP}"
    command.add_argument("inputs", nargs="+", metavar="INPUT", help=inputs)
    command.add_argument(
        "-o", "--output", required=True, metavar="FOLDER", help="for the tables, the plot and the fits"
    )
    command.add_argument("--grid", help=f"of candidates, one of {', '.join(GRIDS)} (default {DEFAULT_GRID})")
    add_recipe(command)
    add_surface(command)


def run_pareto(options: argparse.Namespace) -> dict[str, Any]:
    """Fits, judges and times a grid; what an earlier run has fitted is taken as it is."""
    paths = pareto_paths(options.output)
    try:
        results = _compared(options)
    except KeyboardInterrupt:
        if paths.bundles.exists():
            names = ("grid", "preset", "seed", "budget_seconds", *SURFACE_OPTIONS)
            words = ["pareto", *options.inputs, "-o", options.output]
            again = command_line(words, {name: getattr(options, name) for name in names})
            print(f"what is fitted is kept; to go on:\n  {again}", file=sys.stderr)
        raise
    return {"files": {name: str(path) for name, path in paths._asdict().items()}, **results}


def _compared(options: argparse.Namespace) -> dict[str, Any]:
    folders = [name for name in options.inputs if is_texture_folder(name)]
    if folders:
        return surface_pareto(_surface_config(folders, options), reporter_of(options))
    refuse(options, SURFACE_OPTIONS, "only for a folder of textures")
    recipe = Recipe(options.preset, options.seed, options.budget_seconds)
    config = ParetoConfig(tuple(options.inputs), options.output, recipe, options.grid or DEFAULT_GRID)
    return pareto(config, reporter_of(options))


def _surface_config(folders: list[str], options: argparse.Namespace) -> SurfaceParetoConfig:
    if len(folders) > 1:
        raise JaxbrdfError(f"{folders[1]}: one texture set is compared at a time; {folders[0]} is given already")
    refuse(options, ("grid",), "not for a folder of textures: every model of texture sets is fitted")
    fit = surface_config(folders[0], options)
    return SurfaceParetoConfig(fit, tuple(name for name in options.inputs if name != folders[0]))
