"""Choosing a shape, and keeping what was found out."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from jaxbrdf.errors import OpenCLError
from jaxbrdf.opencl import Material, cache, material, program, tuning
from jaxbrdf.opencl.shape import Shape
from tests.export.bundles import small_bundle
from tests.opencl.conftest import Device


@pytest.fixture
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "cache")


@pytest.mark.usefixtures("_own_cache")
def test_a_trial_finds_a_shape_and_is_remembered(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    found = tuning.best_shape(opencl.device)
    assert found in tuning.candidates(opencl.device)
    monkeypatch.setattr(tuning, "_measure", lambda *_: pytest.fail("measured a second time"))
    assert tuning.best_shape(opencl.device) == found


def test_the_fastest_shape_that_works_is_taken(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    first, second, third = tuning.candidates(opencl.device)[:3]
    names = [f"{s.width},{s.rows}" for s in (first, second, third)]
    lines = [
        *names,
        f"{names[0]} 3e-3",
        f"{names[1]} 2e-3",
        f"{names[0]} 1e-3",
        f"{names[1]} 9e-3",
        "a driver's remark",
    ]
    outputs = iter([(0, lines)])
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: done(*next(outputs)))
    assert tuning._measure(opencl.device, [first, second, third]) == {first: 1e-3, second: 2e-3}


def test_a_shape_that_crashes_the_trial_is_left_out(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    first, second = tuning.candidates(opencl.device)[:2]
    names = [f"{s.width},{s.rows}" for s in (first, second)]
    outputs = iter([(-11, [names[0]]), (0, [names[1], f"{names[1]} 1e-3"])])
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: done(*next(outputs)))
    assert tuning._measure(opencl.device, [first, second]) == {second: 1e-3}


@pytest.mark.usefixtures("_own_cache")
def test_without_a_trial_the_likeliest_shape_is_taken(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "executable", "/nonexistent/python")
    assert tuning.best_shape(opencl.device) == tuning.candidates(opencl.device)[0]


def done(code: int, lines: list[str]) -> Any:
    return subprocess.CompletedProcess([], code, "\n".join(lines), "")


def test_where_a_width_is_refused_the_next_one_is_tried_and_told(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    build = program.build

    def picky(context: cl.Context, source: str) -> cl.Program:
        if "#define JB_WIDTH 16" in source or "#define JB_WIDTH 8\n" in source:
            raise OpenCLError("the OpenCL compiler refuses the program: error: too wide")
        return build(context, source)

    monkeypatch.setattr(material, "build", picky)
    with pytest.warns(RuntimeWarning, match=r"error: too wide; trying width [84]$") as told:
        loaded = Material.load(small_bundle(), opencl.context, shape=Shape(16, 4))
    assert loaded.shape == Shape(4, 4)
    assert len(told) == 2
    w = np.array([[0.6, 0, 0.8]])
    assert np.isfinite(loaded.evaluate(w, w)).all()


@pytest.mark.usefixtures("_own_cache")
def test_a_program_is_compiled_once(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    first = Material.load(small_bundle(), opencl.context, shape=Shape(4, 4))
    monkeypatch.setattr(program, "_compile", lambda *_: pytest.fail("compiled a second time"))
    second = Material.load(small_bundle(), opencl.context, shape=Shape(4, 4))
    w = np.array([[0.6, 0, 0.8]])
    np.testing.assert_array_equal(first.evaluate(w, w), second.evaluate(w, w))


@pytest.mark.usefixtures("_own_cache")
@pytest.mark.parametrize("damage", [b"", b"short", b"x" * 500])
def test_a_damaged_cache_is_compiled_anew(opencl: Device, damage: bytes):
    Material.load(small_bundle(), opencl.context, shape=Shape(4, 4))
    entries = list(cache.folder().iterdir())
    assert entries
    for entry in entries:
        entry.write_bytes(damage)
    w = np.array([[0.6, 0, 0.8]])
    assert np.isfinite(Material.load(small_bundle(), opencl.context, shape=Shape(4, 4)).evaluate(w, w)).all()
    assert all(entry.read_bytes() != damage for entry in entries)


def test_a_cache_that_cannot_be_written_is_no_fault(opencl: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "file" / "cache")
    w = np.array([[0.6, 0, 0.8]])
    assert np.isfinite(Material.load(small_bundle(), opencl.context, shape=Shape(4, 4)).evaluate(w, w)).all()
