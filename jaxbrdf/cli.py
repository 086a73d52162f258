"""The command line: parse, run one job, print its result; a user's mistake is one line and exit code 2."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import NoReturn

import jax

from jaxbrdf.commands.bench import add_bench
from jaxbrdf.commands.compare import add_compare
from jaxbrdf.commands.convert import add_convert
from jaxbrdf.commands.eval import add_eval
from jaxbrdf.commands.fit import add_fit
from jaxbrdf.commands.info import add_info
from jaxbrdf.commands.pareto import add_pareto
from jaxbrdf.commands.render import add_render
from jaxbrdf.commands.stability import add_stability
from jaxbrdf.data.os_fault import os_fault
from jaxbrdf.errors import DataError, JaxbrdfError

EXIT_MISTAKE = 2
EXIT_INTERRUPTED = 130
MOST_DEVICES = 8

COMMANDS = (
    add_fit,
    add_pareto,
    add_bench,
    add_stability,
    add_eval,
    add_compare,
    add_render,
    add_info,
    add_convert,
)

DESCRIPTION = "Small neural and analytic reflectance, fitted with JAX and evaluated with OpenCL."


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
        return options.exit_code(result)
    except JaxbrdfError as error:
        print(f"jaxbrdf: {one_line(str(error))}", file=sys.stderr)
        return EXIT_MISTAKE
    except KeyboardInterrupt:
        print("jaxbrdf: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED


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
    for add in (
        add_fit,
        add_pareto,
        add_bench,
        add_eval,
        add_compare,
        add_render,
        add_info,
        add_convert,
        add_stability,
    ):
        add(commands)
    return top


if __name__ == "__main__":
    sys.exit(main())
