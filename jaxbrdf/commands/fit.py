"""jaxbrdf fit"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from jaxbrdf.commands.command import INPUT_HELP, add_command, command_line, reporter_of, seed
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs.budget import Budget
from jaxbrdf.jobs.fit import FitResult, fit
from jaxbrdf.jobs.fit_config import FitConfig, output_paths
from jaxbrdf.jobs.judge import METRICS
from jaxbrdf.jobs.search import candidates_folder, search
from jaxbrdf.models.table import NAMES
from jaxbrdf.report import text

DEFAULT_MODEL, DEFAULT_METRIC = "gated", "smape"


def add_fit(commands: Any) -> None:
    """The command that fits a material."""
    command = add_command(commands, "fit", "fit a small model to a material", run_fit, text.fit_report)
    command.add_argument("input", metavar="INPUT", help=INPUT_HELP)
    command.add_argument("-o", "--output", required=True, metavar="OUT", help="a folder, or a .safetensors file's name")
    command.add_argument("--model", help=f"one of {', '.join(NAMES)} (default {DEFAULT_MODEL})")
    command.add_argument("--paper-sizes", action="store_true", help="the model exactly as its paper has it")
    add_recipe(command)
    command.add_argument("--resume", action="store_true", help="go on from the checkpoint beside OUT")
    command.add_argument("--precision", choices=("float32", "float16"), default="float32", help="of the stored bundle")
    command.add_argument("--conserve-energy", action="store_true", help="reflect no more light than there is")
    command.add_argument("--no-sampler", action="store_true", help="leave out what draws light in renderers")
    _add_budget(command)


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


def run_fit(options: argparse.Namespace) -> dict[str, Any]:
    """Fits one model, or the one that a budget leads to."""
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
    result = _run(config, options) if budget is None else _run_search(config, budget, options)
    files = {name: str(path) for name, path in result.paths._asdict().items() if name != "checkpoint"}
    return {"files": files, **result.report}


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
