"""What the commands' parsers have in common."""

from __future__ import annotations

import argparse
import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from jaxbrdf.jobs.progress import Reporter, Silent, Terminal

INPUT_HELP = "a measured file (.bsdf, .binary, .bin, .h5), or gold, brushed-aluminium, glazed-ceramic"
FOLDER_HELP = "a folder of PBR textures"
BUNDLE_HELP = "a .safetensors bundle, or the folder that a fit wrote"


def add_command(commands: Any, name: str, says: str, run: Callable, tell: Callable) -> argparse.ArgumentParser:
    """A command's parser.

    Args:
        commands: argparse's subparsers.
        name: of the command.
        says: what it does, in a few words.
        run: options to a plain result.
        tell: that result as text.
    """
    command = commands.add_parser(name, help=says, description=says)
    command.add_argument("--json", action="store_true", help="print the result as JSON")
    command.set_defaults(run=run, tell=tell, exit_code=lambda result: 0)
    return command


def reporter_of(options: argparse.Namespace) -> Reporter:
    """Who is told of progress: nobody where the output is for machines."""
    return Silent() if options.json else Terminal()


def command_line(words: Sequence[str], options: Mapping[str, Any]) -> str:
    """A command as a shell takes it.

    Args:
        words: the command's name and what comes without an option.
        options: by name, with `_` for `-`; one that is None or False is left out, True stands alone.
    """
    parts = [part for name, value in options.items() for part in _words(f"--{name.replace('_', '-')}", value)]
    return shlex.join(["jaxbrdf", *words, *parts])


def _words(name: str, value: Any) -> list[str]:
    if value is None or value is False:
        return []
    return [name] if value is True else [name, str(value)]


def seed(value: str) -> int:
    """A seed that the user wrote.

    Raises:
        argparse.ArgumentTypeError: if it is none.
    """
    return _integer(value, 0, 2**31 - 1)


def count(value: str) -> int:
    """A number of pixels or samples that the user wrote.

    Raises:
        argparse.ArgumentTypeError: if it is none.
    """
    return _integer(value, 1, 2**14)


def number(value: str, *, least: float, most: float) -> float:
    """A number between two others, as the user wrote it.

    Raises:
        argparse.ArgumentTypeError: if it is none.
    """
    try:
        found = float(value)
    except ValueError:
        found = math.nan
    if not least <= found <= most:
        raise argparse.ArgumentTypeError(f"{value!r} is not a number from {least:g} to {most:g}")
    return found


def _integer(value: str, least: int, most: int) -> int:
    # digits first: int() refuses more than a few thousand of them
    if not (value.isascii() and value.isdigit() and len(value) < 20 and least <= int(value) <= most):
        raise argparse.ArgumentTypeError(f"{value!r} is not a whole number from {least} to {most}")
    return int(value)
