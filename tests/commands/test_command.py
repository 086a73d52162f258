"""Commands as a shell takes them."""

from __future__ import annotations

import shlex

from jaxbrdf import cli
from jaxbrdf.commands.command import command_line


def test_a_command_line_leaves_out_what_was_not_given():
    options = {"model": None, "paper_sizes": False, "resume": True, "budget_seconds": 2.5}
    assert command_line(["fit", "gold"], options) == "jaxbrdf fit gold --resume --budget-seconds 2.5"


def test_a_command_line_is_understood():
    line = command_line(["fit", "my gold.bsdf", "-o", "it's"], {"max_ns": 1e-3, "metric": "mae", "max_error": 0.25})
    options = cli.parser().parse_args(shlex.split(line)[1:])
    assert (options.input, options.output) == ("my gold.bsdf", "it's")
    assert (options.max_ns, options.metric, options.max_error) == (1e-3, "mae", 0.25)
