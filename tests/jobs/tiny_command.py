"""The command line with a preset `long` of a few seconds and with no judgement: a process for tests to kill.

Usage: python tests/jobs/tiny_command.py ARGUMENTS
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import jax

sys.path.insert(0, str(Path(__file__).parents[2]))

from jaxbrdf import cli
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs import judge, training
from tests.jobs.tiny import LONG, hasten_judge

if __name__ == "__main__":
    # as many as the tests have, whatever the machine
    jax.config.update("jax_num_cpu_devices", 2)
    jax.devices()
    PRESETS["long"] = lambda: LONG
    training.SECONDS_BETWEEN_CHECKPOINTS = 0.1
    hasten_judge(partial(setattr, judge))
    judge.describe_truth = lambda _: {}
    sys.exit(cli.main())
