"""The command line itself: what it prints where, its exit codes, and the devices it asks JAX for."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import jax
import pytest

import jaxbrdf
from jaxbrdf import cli
from jaxbrdf.commands import fit as fit_command
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.models.table import MODELS
from tests.source import ROOT

COMMANDS = ("fit", "pareto", "bench", "eval", "compare", "render", "info", "convert")


def help_of(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    with pytest.raises(SystemExit) as exit_:
        cli.run([*arguments, "--help"])
    assert exit_.value.code == 0
    return " ".join(capsys.readouterr().out.split())


def test_help_names_every_command_model_and_preset(capsys: pytest.CaptureFixture[str]):
    assert all(command in help_of(capsys) for command in COMMANDS)
    assert all(name in help_of(capsys, "fit") for name in (*MODELS, *PRESETS))
    for command in COMMANDS:
        assert "--json" in help_of(capsys, command)


def test_version(capsys: pytest.CaptureFixture[str]):
    with pytest.raises(SystemExit):
        cli.run(["--version"])
    assert capsys.readouterr().out.strip() == jaxbrdf.__version__


def test_a_result_is_text_for_people_and_json_for_machines(capsys: pytest.CaptureFixture[str]):
    assert cli.run(["info", "glazed-ceramic"]) == 0
    shown = capsys.readouterr()
    assert cli.run(["info", "glazed-ceramic", "--json"]) == 0
    printed = capsys.readouterr()
    fields = json.loads(printed.out)
    assert printed.out.count("\n") == 1
    assert shown.err == printed.err == ""
    assert [line.split()[0] for line in shown.out.splitlines()] == list(fields)


@pytest.mark.parametrize("has_checkpoint", [False, True])
def test_an_interrupted_fit_promises_only_what_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], has_checkpoint: bool
):
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(fit_command, "fit", interrupt)
    if has_checkpoint:
        (tmp_path / "my fit.checkpoint").touch()
    out = tmp_path / "my fit.safetensors"
    assert cli.run(["fit", "gold", "-o", str(out), "--paper-sizes", "--budget-seconds", "5"]) == 130
    *told, last = capsys.readouterr().err.splitlines()
    assert last == "jaxbrdf: interrupted"
    options = "--model gated --preset quick --seed 0 --paper-sizes --precision float32 --resume"
    # as a shell takes it
    again = ["the checkpoint is kept; to go on:", f"  jaxbrdf fit gold -o '{out}' {options}"]
    assert told == (again if has_checkpoint else [])


@pytest.mark.parametrize(("cores", "devices"), [(1, 1), (2, 2), (3, 2), (7, 4), (8, 8), (96, 8)])
def test_it_asks_for_a_power_of_two_of_devices(monkeypatch: pytest.MonkeyPatch, cores: int, devices: int):
    asked = []
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)))
    monkeypatch.setattr(jax.config, "update", lambda *arguments: asked.append(arguments))
    cli.use_every_core()
    assert asked == [("jax_num_cpu_devices", devices)]


def test_devices_that_are_in_use_stay(monkeypatch: pytest.MonkeyPatch):
    before = jax.devices()
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    cli.use_every_core()
    assert jax.devices() == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_a_full_disk_behind_standard_output_is_told_in_one_line():
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "jaxbrdf.cli", "info", "gold"]
        done = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, text=True, cwd=ROOT, timeout=300, check=False
        )
    assert done.returncode == 2
    assert done.stderr == "jaxbrdf: standard output: cannot be written: no space is left on the disk\n"
