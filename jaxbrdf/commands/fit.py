"""jaxbrdf fit"""

from __future__ import annotations

import argparse
import sys
from typing import Any, get_args

from jaxbrdf.commands.command import FOLDER_HELP, INPUT_HELP, add_command, command_line, count, reporter_of, seed
from jaxbrdf.data.texture_name import Convention
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs.budget import Budget
from jaxbrdf.jobs.fit import FitResult, fit
from jaxbrdf.jobs.fit_config import FitConfig, output_paths, surface_paths
from jaxbrdf.jobs.judge import METRICS
from jaxbrdf.jobs.search import candidates_folder, search
from jaxbrdf.jobs.source import is_texture_folder
from jaxbrdf.jobs.surface_config import SurfaceFitConfig
from jaxbrdf.jobs.surface_fit import fit_surface
from jaxbrdf.models.table import NAMES, SPATIAL
from jaxbrdf.report import text

DEFAULT_MODEL, DEFAULT_METRIC = "gated", "smape"

SURFACE_OPTIONS = ("size", "normals", "resample")
HOMOGENEOUS_OPTIONS = ("paper_sizes", "conserve_energy", "no_sampler", "max_ns", "max_error", "metric")


def add_fit(commands: Any) -> None:
    """The command that fits a material."""
    command = add_command(commands, "fit", "fit a small model to a material", run_fit, text.fit_report)
    command.add_argument("input", metavar="INPUT|FOLDER", help=f"{INPUT_HELP}; or {FOLDER_HELP}")
    command.add_argument("-o", "--output", required=True, metavar="OUT", help="a folder, or a .safetensors file's name")
    names = f"one of {', '.join(NAMES)}; of a texture set one of {', '.join(SPATIAL)}"
    command.add_argument("--model", help=f"{names} (default {DEFAULT_MODEL})")
    command.add_argument("--paper-sizes", action="store_true", help="the model exactly as its paper has it")
    add_recipe(command)
    command.add_argument("--resume", action="store_true", help="go on from the checkpoint beside OUT")
    command.add_argument("--precision", choices=("float32", "float16"), default="float32", help="of the stored bundle")
    command.add_argument("--conserve-energy", action="store_true", help="reflect no more light than there is")
    command.add_argument("--no-sampler", action="store_true", help="leave out what draws light in renderers")
    _add_budget(command)
    add_surface(command)


def add_recipe(command: argparse.ArgumentParser) -> None:
    """The options that say how a fit trains."""
    command.add_argument("--preset", default="quick", help=f"one of {', '.join(PRESETS)} (default quick)")
    command.add_argument("--seed", type=seed, default=0, help="of all draws (default 0)")
    command.add_argument("--budget-seconds", type=float, help="choose the number of steps to take about this long")


def _add_budget(command: argparse.ArgumentParser) -> None:
    budget = command.add_argument_group("a budget", "fit the cheapest of all models and sizes that meets it")
    budget.add_argument("--max-ns", type=float, metavar="N", help="nanoseconds of an OpenCL evaluation")
    budget.add_argument("--max-error", type=float, metavar="E", help="of the fit")
    budget.add_argument(
        "--metric", metavar="M", help=f"of --max-error: {', '.join(METRICS)} (default {DEFAULT_METRIC})"
    )


def add_surface(command: argparse.ArgumentParser) -> None:
    """The options that say how a folder of textures is read."""
    surface = command.add_argument_group("a texture set", "fit a model of all places and scales")
    surface.add_argument("--size", type=count, metavar="N", help="texels along the longer side (default: the files')")
    surface.add_argument("--normals", choices=get_args(Convention), help="of the normal map, over what its name says")
    surface.add_argument("--resample", action="store_true", help="maps of other sizes to that of the base colour")


def run_fit(options: argparse.Namespace) -> dict[str, Any]:
    """Fits one model, or the one that a budget leads to."""
    if is_texture_folder(options.input):
        return _result(_run_surface(_surface_config(options), options))
    refuse(options, SURFACE_OPTIONS, "only for a folder of textures")
    budget = _budget(options)
    config = FitConfig(
        source=options.input,
        output=options.output,
        model=options.model or DEFAULT_MODEL,
        paper_sizes=options.paper_sizes,
        preset=options.preset,
        seed=options.seed,
        budget_seconds=options.budget_seconds,
        resume=options.resume,
        precision=options.precision,
        conserve_energy=options.conserve_energy,
        sampler=not options.no_sampler,
    )
    return _result(_run(config, options) if budget is None else _run_search(config, budget, options))


def _result(result: FitResult) -> dict[str, Any]:
    files = {name: str(path) for name, path in result.paths._asdict().items() if name != "checkpoint"}
    return {"files": files, **result.report}


def _surface_config(options: argparse.Namespace) -> SurfaceFitConfig:
    refuse(options, HOMOGENEOUS_OPTIONS, "not for a folder of textures")
    own = {"model": options.model or DEFAULT_MODEL, "resume": options.resume, "precision": options.precision}
    return surface_config(options.input, options, **own)


def surface_config(source: str, options: argparse.Namespace, **more: Any) -> SurfaceFitConfig:
    """The fit of a folder that the options of `add_recipe` and `add_surface`, and `more`, ask for."""
    names = ("output", "preset", "seed", "budget_seconds", *SURFACE_OPTIONS)
    return SurfaceFitConfig(source, **{name: getattr(options, name) for name in names}, **more)


def refuse(options: argparse.Namespace, names: tuple[str, ...], reason: str) -> None:
    """Ends a command that was given one of these options.

    Raises:
        JaxbrdfError: naming it and the reason.
    """
    for name in names:
        if getattr(options, name) not in (None, False):
            raise JaxbrdfError(f"--{name.replace('_', '-')} is {reason}")


def _run_surface(config: SurfaceFitConfig, options: argparse.Namespace) -> FitResult:
    try:
        return fit_surface(config, reporter_of(options))
    except KeyboardInterrupt:
        if surface_paths(config.output).checkpoint.exists():
            given = {
                name: getattr(options, name) for name in ("model", "preset", "seed", "precision", *SURFACE_OPTIONS)
            }
            again = command_line(["fit", config.source, "-o", config.output], {**given, "resume": True})
            print(f"the checkpoint is kept; to go on:\n  {again}", file=sys.stderr)
        raise


def _budget(options: argparse.Namespace) -> Budget | None:
    if options.metric is not None and options.max_error is None:
        raise JaxbrdfError("--metric says what --max-error is an error of; there is no --max-error")
    if options.max_ns is None and options.max_error is None:
        return None
    return Budget(options.max_ns, options.max_error, options.metric or DEFAULT_METRIC, options.model)


def _run(config: FitConfig, options: argparse.Namespace) -> FitResult:
    try:
        return fit(config, reporter_of(options))
    except KeyboardInterrupt:
        if output_paths(config.output).checkpoint.exists():
            # the checkpoint knows its number of steps
            _tell("the checkpoint is kept", config, model=config.model)
        raise


def _run_search(config: FitConfig, budget: Budget, options: argparse.Namespace) -> FitResult:
    try:
        return search(config, budget, reporter_of(options))
    except KeyboardInterrupt:
        if candidates_folder(output_paths(config.output)).exists():
            limits = {"max_ns": budget.max_ns, "max_error": budget.max_error, "metric": options.metric}
            _tell("what is fitted is kept", config, model=budget.model, budget_seconds=config.budget_seconds, **limits)
        raise


def _tell(kept: str, config: FitConfig, *, model: str | None, **more: Any) -> None:
    """How an interrupted fit goes on."""
    given = {"preset": config.preset, "seed": config.seed, "paper_sizes": config.paper_sizes}
    parts = {"conserve_energy": config.conserve_energy, "no_sampler": not config.sampler}
    options = {"model": model, **given, "precision": config.precision, **parts, **more, "resume": True}
    again = command_line(["fit", config.source, "-o", config.output], options)
    print(f"{kept}; to go on:\n  {again}", file=sys.stderr)
