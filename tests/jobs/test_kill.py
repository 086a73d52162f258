"""A fit that is killed and one that is interrupted go on to the bits of an undisturbed one."""

from __future__ import annotations

import contextlib
import os
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

from jaxbrdf.fit import checkpoint
from tests.source import ROOT

COMMAND = [sys.executable, str(ROOT / "tests" / "jobs" / "tiny_command.py"), "fit", "gold", "--preset", "tiny"]
PATIENCE = 300.0


Start = Callable[..., subprocess.Popen[str]]


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


def test_killed_interrupted_and_undisturbed_fits_end_in_the_same_bits(tmp_path: Path, start: Start):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    undisturbed = start(whole)
    state = parts / "bundle.checkpoint"

    killed = start(parts)
    at_kill = stop(killed, state, signal.SIGKILL)
    assert killed.returncode == -signal.SIGKILL
    killed.communicate()
    assert 0 < at_kill < 4000
    # a kill may leave the part of a file that was being written, under a name of its own, and nothing else
    assert {path.name for path in parts.iterdir() if path.suffix != ".part"} == {"bundle.checkpoint"}

    interrupted = start(parts, "--resume")
    at_interruption = stop(interrupted, state, signal.SIGINT)
    told = finish(interrupted, 130)
    assert at_kill < at_interruption < 4000
    assert checkpoint.read_record(state)["steps"] == 4000
    line = f"jaxbrdf fit gold -o {parts} --model gated --preset tiny --seed 0 --precision float32 --resume"
    assert told.splitlines()[-3:] == ["the checkpoint is kept; to go on:", f"  {line}", "jaxbrdf: interrupted"]

    finish(start(parts, "--resume"), 0)
    finish(undisturbed, 0)
    found, expected = (safetensors.numpy.load_file(out / "bundle.safetensors") for out in (parts, whole))
    assert found.keys() == expected.keys()
    for name, tensor in expected.items():
        np.testing.assert_array_equal(found[name].view(np.int32), tensor.view(np.int32), err_msg=name)
    assert not state.exists()
