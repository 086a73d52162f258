"""jaxbrdf render"""

from __future__ import annotations

import argparse
from functools import partial
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, FOLDER_HELP, INPUT_HELP, add_command, count, number, seed
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.jobs.render import STUDIO, render
from jaxbrdf.render.plane import PlaneView
from jaxbrdf.report import text

SPHERE, PLANE = "sphere", "plane"
NEAREST, FARTHEST = 1e-6, 1e6
"""Distances that can be asked for: texture coordinates in float32 have digits of a period up to there."""

MOST_SLANTED = 89.0


def add_render(commands: Any) -> None:
    """The command that makes a picture."""
    command = add_command(commands, "render", "render a sphere or a plane of a material", run_render, text.written)
    says = f"{BUNDLE_HELP}; or {INPUT_HELP}; or, for a plane, {FOLDER_HELP}"
    command.add_argument("source", metavar="BUNDLE|INPUT", help=says)
    command.add_argument("--env", default=STUDIO, metavar="MAP", help="an .hdr or .exr map, studio (default) or sun")
    command.add_argument("-o", "--output", required=True, metavar="OUT", help="an .exr or .png file's name")
    command.add_argument("--size", type=count, default=512, help="pixels a side (default 512)")
    command.add_argument("--samples", type=count, default=128, help="a pixel (default 128)")
    command.add_argument("--seed", type=seed, default=0, help="of the samples (default 0)")
    command.add_argument("--scene", choices=(SPHERE, PLANE), default=SPHERE, help="what is seen (default sphere)")
    _add_view(command)


def _add_view(command: argparse.ArgumentParser) -> None:
    view = command.add_argument_group("a plane", "seen by a camera of 40 degrees; the texture repeats every unit")
    distance, slant = partial(number, least=NEAREST, most=FARTHEST), partial(number, least=0.0, most=MOST_SLANTED)
    view.add_argument("--distance", type=distance, metavar="D", help="of the camera, in periods (default 2)")
    view.add_argument("--slant", type=slant, metavar="DEG", help="of the camera from the normal, degrees (default 0)")


def run_render(options: argparse.Namespace) -> dict[str, Any]:
    """Writes the picture."""
    size, samples, seed, view = options.size, options.samples, options.seed, _view(options)
    path = render(options.source, options.env, options.output, size=size, samples=samples, seed=seed, view=view)
    return {"output": str(path)}


def _view(options: argparse.Namespace) -> PlaneView | None:
    given = {name: getattr(options, name) for name in ("distance", "slant") if getattr(options, name) is not None}
    if options.scene == PLANE:
        return PlaneView(**given)
    if given:
        raise JaxbrdfError(f"--{next(iter(given))}: goes with --scene plane")
    return None
