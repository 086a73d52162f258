"""Fits from end to end: an undisturbed one, and one that is killed and interrupted and ends in the same bits."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import safetensors
import safetensors.numpy

from jaxbrdf.export import bundle as bundles
from jaxbrdf.fit import checkpoint
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.fit import FitResult, fit
from jaxbrdf.jobs.fit_config import FitConfig
from tests.jobs.tiny import LONG, Listener
from tests.source import ROOT

COMMAND = [sys.executable, str(ROOT / "tests" / "jobs" / "tiny_command.py"), "fit", "gold", "--preset", "long"]
COMMAND.append("--no-sampler")
PATIENCE = 300.0

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> FitResult:
    """Gold by the gated model, in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(PRESETS, "long", lambda: LONG)
        patch.setattr(judge, "SIZE", 32)
        patch.setattr(judge, "SAMPLES", 4)
        out = str(tmp_path_factory.mktemp("fit") / "whole")
        return fit(FitConfig("gold", out, preset="long", sampler=False), Listener())


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts a fit into a folder; none outlives the test."""
    with contextlib.ExitStack() as stack:

        def begin(out: Path, *options: str) -> subprocess.Popen[str]:
            command = [*COMMAND, "-o", str(out), *options]
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
            process = stack.enter_context(subprocess.Popen(command, cwd=ROOT, text=True, **pipes))
            stack.callback(process.kill)
            return process

        yield begin


def finish(process: subprocess.Popen[str], code: int) -> str:
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == code, err
    assert "Traceback" not in err
    return out + err


def step_of(path: Path) -> int:
    """The step of a checkpoint, which may not be there yet; it is whole whenever it is read."""
    if not path.exists():
        return -1
    with safetensors.safe_open(path, framework="numpy") as file:
        return int(file.get_tensor("step"))


def stop(process: subprocess.Popen[str], path: Path, sent: signal.Signals) -> int:
    """Sends a signal when the checkpoint has moved on; returns the step that it holds afterwards."""
    first, until = step_of(path), time.monotonic() + PATIENCE
    while step_of(path) <= max(first, 0) and process.poll() is None and time.monotonic() < until:
        time.sleep(0.01)
    os.kill(process.pid, sent)
    process.wait(PATIENCE)
    return step_of(path)


def test_training_and_judgement_fit_together(undisturbed: FitResult, tmp_path: Path):
    errors, cost = undisturbed.report["errors"], undisturbed.report["cost"]
    assert errors["smape"] < 0.02
    assert errors["mae_standard_error"] < errors["mae"]
    assert errors["image_flip"] < 0.05
    assert cost.keys() >= {"fit_seconds", "compile_seconds", "jax_ns_per_evaluation", "opencl_ns_per_evaluation"}
    assert min(cost.values()) > 0
    copy = shutil.copy(undisturbed.paths.bundle, tmp_path / "moved.safetensors")
    assert bundles.load(copy).manifest.errors == errors


def test_a_killed_and_interrupted_fit_ends_in_the_same_bits(tmp_path: Path, start: Start, undisturbed: FitResult):
    out = tmp_path / "out"
    state = out / "bundle.checkpoint"

    killed = start(out)
    at_kill = stop(killed, state, signal.SIGKILL)
    assert killed.returncode == -signal.SIGKILL
    assert 0 < at_kill < LONG.steps
    # a kill may leave the part of a file that was being written, under a name of its own, and nothing else
    assert {path.name for path in out.iterdir() if path.suffix != ".part"} == {"bundle.checkpoint"}

    interrupted = start(out, "--resume")
    at_interruption = stop(interrupted, state, signal.SIGINT)
    told = finish(interrupted, 130)
    assert at_kill < at_interruption < LONG.steps
    assert checkpoint.read_record(state)["steps"] == LONG.steps
    line = f"jaxbrdf fit gold -o {out} --model gated --preset long --seed 0 --precision float32 --no-sampler --resume"
    assert told.splitlines()[-3:] == ["the checkpoint is kept; to go on:", f"  {line}", "jaxbrdf: interrupted"]

    finish(start(out, "--resume"), 0)
    paths = out / "bundle.safetensors", undisturbed.paths.bundle
    found, expected = (safetensors.numpy.load_file(path) for path in paths)
    assert found.keys() == expected.keys()
    for name, tensor in expected.items():
        np.testing.assert_array_equal(found[name].view(np.int32), tensor.view(np.int32), err_msg=name)
    assert not state.exists()
