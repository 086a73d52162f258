"""The command line: parse, run one job, print its result; a user's mistake is one line and exit code 2."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Any, NoReturn

import jax

from jaxbrdf.data.os_fault import os_fault
from jaxbrdf.errors import DataError, JaxbrdfError
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs.compare import compare
from jaxbrdf.jobs.convert import convert
from jaxbrdf.jobs.evaluate import BACKENDS, evaluate
from jaxbrdf.jobs.fit import fit
from jaxbrdf.jobs.fit_config import FitConfig, output_paths
from jaxbrdf.jobs.info import info
from jaxbrdf.jobs.progress import Silent, Terminal
from jaxbrdf.jobs.render import STUDIO, render
from jaxbrdf.models.table import MODELS
from jaxbrdf.report import text

EXIT_MISTAKE = 2
EXIT_INTERRUPTED = 130
MOST_DEVICES = 8

DESCRIPTION = "Small neural and analytic reflectance, fitted with JAX and evaluated with OpenCL."
INPUT_HELP = "a measured file (.bsdf, .binary, .bin, .h5), or gold, brushed-aluminium, glazed-ceramic"
BUNDLE_HELP = "a .safetensors bundle, or the folder that a fit wrote"


class Parser(argparse.ArgumentParser):
    """A parser whose mistakes are told in one line, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        self.exit(EXIT_MISTAKE, f"{self.prog}: {one_line(message)}\n")


def main() -> int:
    """Runs the command that the process was started with and returns its exit code."""
    return run(sys.argv[1:])


def run(arguments: Sequence[str]) -> int:
    """Runs one command and returns its exit code.

    Raises:
        SystemExit: of a mistake in the arguments, or after --help and --version.
    """
    options = parser().parse_args(arguments)
    use_every_core()
    try:
        result = options.run(options)
        print_result(json.dumps(result) if options.json else options.tell(result))
    except JaxbrdfError as error:
        print(f"jaxbrdf: {one_line(str(error))}", file=sys.stderr)
        return EXIT_MISTAKE
    except KeyboardInterrupt:
        print("jaxbrdf: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    return 0


def one_line(text: str) -> str:
    """The text without line breaks, which a file's name may hold."""
    return " ".join(text.splitlines())


def print_result(result: str) -> None:
    """Prints to standard output, all of it at once.

    Raises:
        DataError: if it cannot be written, as on a full disk.
    """
    try:
        print(result, flush=True)
    except OSError as error:
        # what is left in the buffer would fail once more at exit, with a traceback
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise DataError("standard output", f"cannot be written: {os_fault(error)}") from None


def use_every_core() -> None:
    """Lets JAX train on one device a core, the greatest power of two that there are, so that batches divide evenly.

    Where JAX has been used already, as in a notebook, it keeps the devices that it has.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    devices = 1
    while 2 * devices <= min(cores, MOST_DEVICES):
        devices *= 2
    with contextlib.suppress(RuntimeError):
        jax.config.update("jax_num_cpu_devices", devices)


def parser() -> argparse.ArgumentParser:
    """The commands and their options."""
    top = Parser(prog="jaxbrdf", description=DESCRIPTION)
    top.add_argument("--version", action="version", version=version("jaxbrdf"))
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    _add_fit(commands)
    _add_eval(commands)
    _add_compare(commands)
    _add_render(commands)
    _add_info(commands)
    _add_convert(commands)
    return top


def _command(commands: Any, name: str, says: str, run: Callable, tell: Callable) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=says, description=says)
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run, tell=tell)
    return command


def _add_fit(commands: Any) -> None:
    command = _command(commands, "fit", "fit a small model to a material", _fit, text.fit_report)
    command.add_argument("input", metavar="INPUT", help=INPUT_HELP)
    command.add_argument("-o", "--output", required=True, metavar="OUT", help="a folder, or a .safetensors file's name")
    command.add_argument("--model", default="gated", help=f"one of {', '.join(MODELS)} (default gated)")
    command.add_argument("--paper-sizes", action="store_true", help="the model exactly as its paper has it")
    command.add_argument("--preset", default="quick", help=f"one of {', '.join(PRESETS)} (default quick)")
    command.add_argument("--seed", type=_seed, default=0, help="of all draws (default 0)")
    command.add_argument("--budget-seconds", type=float, help="choose the number of steps to take about this long")
    command.add_argument("--resume", action="store_true", help="go on from the checkpoint beside OUT")
    command.add_argument("--precision", choices=("float32", "float16"), default="float32", help="of the stored bundle")


def _fit(options: argparse.Namespace) -> dict[str, Any]:
    config = FitConfig(
        source=options.input,
        output=options.output,
        model=options.model,
        paper_sizes=options.paper_sizes,
        preset=options.preset,
        seed=options.seed,
        budget_seconds=options.budget_seconds,
        resume=options.resume,
        precision=options.precision,
    )
    reporter = Silent() if options.json else Terminal()
    try:
        result = fit(config, reporter)
    except KeyboardInterrupt:
        if output_paths(options.output).checkpoint.exists():
            again = shlex.join([*_command_line(options), "--resume"])
            print(f"the checkpoint is kept; to go on:\n  {again}", file=sys.stderr)
        raise
    files = {name: str(path) for name, path in result.paths._asdict().items() if name != "checkpoint"}
    return {"files": files, **result.report}


def _command_line(options: argparse.Namespace) -> list[str]:
    given = {"--model": options.model, "--preset": options.preset, "--seed": options.seed}
    flags = [part for name, value in given.items() for part in (name, str(value))]
    sizes = ["--paper-sizes"] if options.paper_sizes else []
    return ["jaxbrdf", "fit", options.input, "-o", options.output, *flags, *sizes, "--precision", options.precision]


def _seed(value: str) -> int:
    return _integer(value, 0, 2**31 - 1)


def _count(value: str) -> int:
    return _integer(value, 1, 2**14)


def _integer(value: str, least: int, most: int) -> int:
    # digits first: int() refuses more than a few thousand of them
    if not (value.isascii() and value.isdigit() and len(value) < 20 and least <= int(value) <= most):
        raise argparse.ArgumentTypeError(f"{value!r} is not a whole number from {least} to {most}")
    return int(value)


def _add_eval(commands: Any) -> None:
    command = _command(commands, "eval", "evaluate a material at given directions", _eval, text.written)
    command.add_argument("source", metavar="BUNDLE|INPUT", help=f"{BUNDLE_HELP}; or {INPUT_HELP}")
    command.add_argument("--directions", required=True, metavar="DIRS.npz", help="arrays wi and wo, float32 (N, 3)")
    command.add_argument("-o", "--output", required=True, metavar="VALUES.npy", help="f, float32 (N, 3)")
    command.add_argument("--backend", choices=BACKENDS, default="jax", help="opencl is for bundles")


def _eval(options: argparse.Namespace) -> dict[str, Any]:
    count = evaluate(options.source, options.directions, options.output, backend=options.backend)
    return {"output": options.output, "queries": count, "backend": options.backend}


def _add_compare(commands: Any) -> None:
    command = _command(commands, "compare", "judge a bundle against its reference", _compare, text.comparison)
    command.add_argument("bundle", metavar="BUNDLE", help=BUNDLE_HELP)
    command.add_argument("input", metavar="INPUT", help=INPUT_HELP)
    command.add_argument("--against", metavar="NBRDF.h5", help="a published network to be judged beside it")


def _compare(options: argparse.Namespace) -> dict[str, Any]:
    return compare(options.bundle, options.input, against=options.against)


def _add_render(commands: Any) -> None:
    command = _command(commands, "render", "render a sphere of a material", _render, text.written)
    command.add_argument("source", metavar="BUNDLE|INPUT", help=f"{BUNDLE_HELP}; or {INPUT_HELP}")
    command.add_argument("--env", default=STUDIO, metavar="MAP", help="an .hdr or .exr map, studio (default) or sun")
    command.add_argument("-o", "--output", required=True, metavar="OUT", help="an .exr or .png file's name")
    command.add_argument("--size", type=_count, default=512, help="pixels a side (default 512)")
    command.add_argument("--samples", type=_count, default=128, help="a pixel (default 128)")
    command.add_argument("--seed", type=_seed, default=0, help="of the samples (default 0)")


def _render(options: argparse.Namespace) -> dict[str, Any]:
    size, samples, seed = options.size, options.samples, options.seed
    return {"output": str(render(options.source, options.env, options.output, size=size, samples=samples, seed=seed))}


def _add_info(commands: Any) -> None:
    command = _command(commands, "info", "tell what a file is", _info, text.fields)
    command.add_argument("file", metavar="FILE", help=f"{BUNDLE_HELP}; or {INPUT_HELP}")


def _info(options: argparse.Namespace) -> dict[str, Any]:
    return info(options.file)


def _add_convert(commands: Any) -> None:
    command = _command(commands, "convert", "resample a material into a MERL or UTIA file", _convert, text.written)
    command.add_argument("source", metavar="IN", help=f"{BUNDLE_HELP}; or {INPUT_HELP}")
    command.add_argument("output", metavar="OUT", help="a name ending in .binary (MERL) or .bin (UTIA)")


def _convert(options: argparse.Namespace) -> dict[str, Any]:
    return {"output": str(convert(options.source, options.output))}


if __name__ == "__main__":
    sys.exit(main())
