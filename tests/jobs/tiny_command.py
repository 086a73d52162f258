"""The command line with a preset `long` of a few seconds and with no judgement: a process for tests to kill.

Usage: python tests/jobs/tiny_command.py ARGUMENTS
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import jax
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from jaxbrdf import cli
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs import judge, training
from tests.jobs.tiny import LONG

PICTURE = np.random.default_rng(0).uniform(0.1, 1.0, (16, 16, 3))

if __name__ == "__main__":
    # as many as the tests have, whatever the machine
    jax.config.update("jax_num_cpu_devices", 2)
    jax.devices()
    PRESETS["long"] = lambda: LONG
    training.SECONDS_BETWEEN_CHECKPOINTS = 0.1
    judge.compare_many = partial(judge.compare_many, pairs=2**10, chunk=2**10)
    judge.describe_truth = lambda _: {}
    judge.render_pair = lambda *_: judge.Pictures(PICTURE, PICTURE)
    judge.evaluation_cost = lambda _: {"jax_ns_per_evaluation": 1.0}
    sys.exit(cli.main())
