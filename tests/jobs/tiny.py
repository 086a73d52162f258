"""Fits that take a second, judgements that take none, and the command line in this process."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf import cli
from jaxbrdf.brdf.albedo_table import AlbedoTable
from jaxbrdf.checks.parity import random_params
from jaxbrdf.errors import FitError
from jaxbrdf.fit.loop import LoopConfig
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs import judge, store
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.training import Task, Trained
from jaxbrdf.metrics.residual_map import residual_map
from jaxbrdf.models.table import first_params
from jaxbrdf.sampling.view_proxy import ViewProxy

TINY = dataclasses.replace(
    PRESETS["quick"](), name="tiny", steps=600, pool=2**14, loop=LoopConfig(batch=512, microbatch=128, ema=0.02)
)
"""Four pieces a device, so that gradients are accumulated, and a pool that is read many times."""


LONG = dataclasses.replace(TINY, name="long", steps=4000)
"""Takes long enough to be stopped in the middle."""


PICTURES = judge.Pictures(*np.random.default_rng(0).uniform(0.1, 1.0, (2, 16, 16, 3)))

NO_RESIDUALS = residual_map([], lambda _: jnp.zeros((0, 3)), cells=2)


def hasten_judge(replace: Callable[[str, Any], object], *, pairs: int = 2**16) -> None:
    """Makes judgements quick: few pairs, made-up pictures and prices.

    Args:
        replace: of an attribute of the judge's module.
        pairs: that errors are means over.
    """
    replace("PAIRS", pairs)
    replace("light", lambda _: None)
    replace("pictures", lambda fits, _: dict.fromkeys(fits, PICTURES))
    replace("evaluation_cost", lambda _: {"jax_ns_per_evaluation": 100.0})


def hasten_finishing(replace: Callable[[str, Any], object]) -> None:
    """Makes up the albedo and the sampler of finished bundles.

    Args:
        replace: of an attribute of the finishing's module.
    """
    replace("tabulate_albedo", lambda *_, **__: AlbedoTable(np.full((1, 2, 3), 0.5, np.float32)))
    replace("fit_proxy", lambda *_, **__: ViewProxy(np.zeros((1, 2, 9), np.float32)))


def pretend_to_train(replace: Callable[[str, Any], object]) -> list[str]:
    """Makes the fits of stores end at once; returns their names, those of their checkpoints, as they come.

    Args:
        replace: of an attribute of the store's module.
    """
    names: list[str] = []

    def train(task: Task, budget_seconds: float | None, resume: bool, reporter: Reporter) -> Trained:
        del budget_seconds, resume
        names.append(task.checkpoint.stem)
        with reporter.steps("fitting", 7) as tell:
            tell(0, "")
        task.checkpoint.write_bytes(b"the state")
        return Trained(random_params(len(names), task.model), 7, {"fit_seconds": 1.5, "compile_seconds": 0.5})

    def solved(candidate: Candidate, reference: Any, *_: Any) -> Trained:
        names.append(candidate.slug)
        sizes = candidate.sizes(isotropic=reference.material.isotropic)
        params = jax.tree.map(np.asarray, first_params(jax.random.key(0), candidate.model, sizes))
        return Trained(params, 7, {"fit_seconds": 1.5, "compile_seconds": 0.5}, {"start_costs": [0.1]})

    replace("train", train)
    replace("solved", solved)
    return names


def let_diverge(patch: pytest.MonkeyPatch, checkpoint: str) -> None:
    """Makes the store's training diverge whose checkpoint has this name."""
    usual = store.train

    def train(task: Task, *others: Any) -> Trained:
        if task.checkpoint.stem == checkpoint:
            raise FitError("the fit diverged")
        return usual(task, *others)

    patch.setattr(store, "train", train)


class Listener:
    """A reporter that keeps what it is told, and may act on it.

    Attributes:
        lines: said.
        notes: (step, note) of the progress.
    """

    def __init__(self, act: Any = None) -> None:
        self.lines: list[str] = []
        self.notes: list[tuple[int, str]] = []
        self.act = act

    def say(self, line: str) -> None:
        self.lines.append(line)

    @contextmanager
    def steps(self, title: str, total: int) -> Iterator[Any]:
        del title, total
        yield self._tell

    def _tell(self, done: int, note: str) -> None:
        self.notes.append((done, note))
        if self.act is not None:
            self.act(done)


def run_json(capsys: Any, *arguments: object) -> dict[str, Any]:
    """What a command that succeeds prints for machines: one JSON object and nothing else."""
    assert cli.run([*map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)
