"""jaxbrdf render"""

from __future__ import annotations

import argparse
from typing import Any

from jaxbrdf.commands.command import BUNDLE_HELP, INPUT_HELP, add_command, count, seed
from jaxbrdf.jobs.render import STUDIO, render
from jaxbrdf.report import text


def add_render(commands: Any) -> None:
    """The command that makes a picture."""
    command = add_command(commands, "render", "render a sphere of a material", run_render, text.written)
    command.add_argument("source", metavar="BUNDLE|INPUT", help=f"{BUNDLE_HELP}; or {INPUT_HELP}")
    command.add_argument("--env", default=STUDIO, metavar="MAP", help="an .hdr or .exr map, studio (default) or sun")
    command.add_argument("-o", "--output", required=True, metavar="OUT", help="an .exr or .png file's name")
    command.add_argument("--size", type=count, default=512, help="pixels a side (default 512)")
    command.add_argument("--samples", type=count, default=128, help="a pixel (default 128)")
    command.add_argument("--seed", type=seed, default=0, help="of the samples (default 0)")


def run_render(options: argparse.Namespace) -> dict[str, Any]:
    """Writes the picture."""
    size, samples, seed = options.size, options.samples, options.seed
    return {"output": str(render(options.source, options.env, options.output, size=size, samples=samples, seed=seed))}
