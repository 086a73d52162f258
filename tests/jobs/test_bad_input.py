"""Whatever a command is given that it cannot use: exit code 2, one line that names it, and nothing left behind."""

from __future__ import annotations

import errno
import json
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy

from jaxbrdf import cli
from jaxbrdf.data import exr, output
from jaxbrdf.data import input as data_input
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import fit as fit_job
from jaxbrdf.jobs import price, search, store
from jaxbrdf.opencl import platform
from tests.export.bundles import small_bundle
from tests.writers import rgl

Tell = Callable[..., str]

BUNDLE = bundles.to_bytes(small_bundle())
RGL = rgl.tensor_file(rgl.fields())


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a good file of each kind that the commands take; a fit that starts fails the test."""
    monkeypatch.chdir(tmp_path)

    def fail(*_: Any) -> None:
        pytest.fail("the training was started")

    monkeypatch.setattr(fit_job, "train", fail)
    monkeypatch.setattr(store, "train", fail)
    Path("good.safetensors").write_bytes(BUNDLE)
    Path("good.bsdf").write_bytes(RGL)
    up = np.tile(np.array([0.0, 0.0, 1.0], np.float32), (4, 1))
    np.savez("good.npz", wi=up, wo=up)
    return tmp_path


@pytest.fixture
def mistake(here: Path, capsys: pytest.CaptureFixture[str]) -> Tell:
    """Runs a command that must fail: returns its one line."""

    def run(*arguments: object) -> str:
        before = contents(here)
        try:
            code = cli.run([str(argument) for argument in arguments])
        except SystemExit as exit_:
            code = exit_.code
        out, line = capsys.readouterr()
        assert (code, out, line.count("\n")) == (2, "", 1), line
        assert line.startswith("jaxbrdf")
        assert contents(here) == before
        return line

    return run


def contents(folder: Path) -> dict[Path, bytes | None]:
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


COMMANDS: dict[str, Callable[[str], list[str]]] = {
    "fit": lambda bad: ["fit", bad, "-o", "out"],
    "fit within a budget": lambda bad: ["fit", bad, "-o", "out", "--max-error", "0.1"],
    "pareto": lambda bad: ["pareto", bad, "-o", "out"],
    "pareto with a good one": lambda bad: ["pareto", "gold", bad, "-o", "out"],
    "bench": lambda bad: ["bench", bad],
    "eval": lambda bad: ["eval", bad, "--directions", "good.npz", "-o", "out.npy"],
    "eval opencl": lambda bad: ["eval", bad, "--directions", "good.npz", "-o", "out.npy", "--backend", "opencl"],
    "compare a": lambda bad: ["compare", bad, "gold"],
    "compare b": lambda bad: ["compare", "good.safetensors", bad],
    "compare c": lambda bad: ["compare", "good.safetensors", "gold", "--against", bad],
    "render": lambda bad: ["render", bad, "-o", "out.png"],
    "render a plane": lambda bad: ["render", bad, "-o", "out.png", "--scene", "plane"],
    "info": lambda bad: ["info", bad],
    "convert": lambda bad: ["convert", bad, "out.bin"],
}

PLANE_OF_GOLD = ["render", "gold", "-o", "out.png", "--scene", "plane"]

FILES: dict[str, tuple[str, bytes, str]] = {
    "an empty table": ("bad.bsdf", b"", "empty"),
    "an empty bundle": ("bad.safetensors", b"", "empty"),
    "a cut table": ("bad.bsdf", RGL[:-9], ""),
    "a cut bundle": ("bad.safetensors", BUNDLE[:-9], "not a safetensors file"),
    "wrong magic": ("bad.bsdf", b"tensor_fail\0" + RGL[12:], "not an RGL"),
    "a claim of 2^31 cells": ("bad.binary", struct.pack("<3i", 2**10, 2**10, 2**11) + bytes(100), "dimensions"),
    "noise as UTIA": ("bad.bin", b"hello " * 100, "bytes"),
    "noise as HDF5": ("bad.h5", b"hello " * 100, ""),
    "an unknown kind": ("bad.txt", b"hello " * 100, "not a known measurement"),
    "a line break in its name": ("bad\nfile.bsdf", b"hello", ""),
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("case", FILES)
def test_a_bad_file(mistake: Tell, command: str, case: str):
    name, content, fault = FILES[case]
    Path(name).write_bytes(content)
    line = mistake(*COMMANDS[command](name))
    assert name.replace("\n", " ") in line
    wants_bundle = command in ("bench", "eval opencl", "compare a") and not name.endswith(".safetensors")
    assert ("is not a bundle" if wants_bundle else fault) in line


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    "name", ["none.bsdf", "none.safetensors", "none", "a/b/none.bsdf", "folder", "x" * 300, "good.bsdf/none.bsdf"]
)
def test_a_path_without_a_file(mistake: Tell, command: str, name: str):
    Path("folder").mkdir()
    assert name in mistake(*COMMANDS[command](name))


@pytest.mark.parametrize("command", ["fit", "info", "render"])
def test_a_file_that_may_not_be_read(mistake: Tell, monkeypatch: pytest.MonkeyPatch, command: str):
    class Refusing(type(Path())):
        def open(self, *_: Any, **__: Any) -> Any:
            raise PermissionError(errno.EACCES, "Permission denied")

    # root may read anything
    monkeypatch.setattr(data_input, "Path", Refusing)
    assert "good.bsdf: permission denied" in mistake(*COMMANDS[command]("good.bsdf"))


def with_schema(schema: Any) -> bytes:
    header = json.loads(BUNDLE[8 : 8 + struct.unpack("<Q", BUNDLE[:8])[0]])
    manifest = json.loads(header["__metadata__"]["jaxbrdf"]) | {"schema": schema}
    return safetensors.numpy.save(safetensors.numpy.load(BUNDLE), metadata={"jaxbrdf": json.dumps(manifest)})


@pytest.mark.parametrize(
    "command", ["bench", "pareto", "eval", "eval opencl", "compare a", "render", "info", "convert"]
)
def test_a_bundle_of_a_newer_schema(mistake: Tell, command: str):
    Path("new.safetensors").write_bytes(with_schema(99))
    assert "new.safetensors: schema 99 is newer than this jaxbrdf" in mistake(*COMMANDS[command]("new.safetensors"))


OUTPUTS: dict[str, Callable[[str], list[str]]] = {
    "fit": lambda out: ["fit", "gold", "-o", f"{out}/fit"],
    "fit to a file": lambda out: ["fit", "gold", "-o", f"{out}/fit.safetensors"],
    "fit within a budget": lambda out: ["fit", "gold", "-o", f"{out}/fit", "--max-ns", "100"],
    "pareto": lambda out: ["pareto", "gold", "-o", f"{out}/compared"],
    "eval": lambda out: ["eval", "gold", "--directions", "good.npz", "-o", f"{out}/f.npy"],
    "render": lambda out: ["render", "gold", "-o", f"{out}/f.exr"],
    "convert": lambda out: ["convert", "gold", f"{out}/f.bin"],
}


@pytest.mark.parametrize("command", OUTPUTS)
@pytest.mark.parametrize("folder", ["good.bsdf", "/proc", "/proc/self/none", "/dev/null", "x" * 300])
def test_an_output_that_cannot_be_written(mistake: Tell, command: str, folder: str):
    line = mistake(*OUTPUTS[command](folder))
    assert line.startswith(f"jaxbrdf: {folder}")
    assert "cannot be" in line or "is a file, not a folder" in line


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("f.npy", ["eval", "gold", "--directions", "good.npz", "-o", "f.npy"]),
        ("f.png", ["render", "gold", "-o", "f.png"]),
        ("f.bin", ["convert", "gold", "f.bin"]),
        ("out/bundle.png", ["fit", "gold", "-o", "out"]),
        ("out/fit.safetensors", ["fit", "gold", "-o", "out/fit.safetensors"]),
        ("out/fit.png", ["fit", "gold", "-o", "out/fit.safetensors", "--max-ns", "100"]),
    ],
)
def test_an_output_that_is_a_folder(mistake: Tell, name: str, arguments: list[str]):
    Path(name).mkdir(parents=True)
    assert f"{name}: cannot be written: it is a folder, not a file" in mistake(*arguments)


@pytest.mark.parametrize(("name", "command"), [("f.npy", "eval"), ("f.bin", "convert")])
def test_a_disk_that_fills_while_the_result_is_written(
    mistake: Tell, monkeypatch: pytest.MonkeyPatch, name: str, command: str
):
    def write_new(path: Path, content: bytes) -> None:
        path.write_bytes(content[: len(content) // 2])
        if content:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(output, "_write_new", write_new)
    Path(name).write_bytes(b"from before")
    line = mistake(*OUTPUTS[command](".")[:-1], name)
    assert line == f"jaxbrdf: {name}: cannot be written: no space is left on the disk\n"


def test_a_full_device(mistake: Tell):
    line = mistake("eval", "gold", "--directions", "good.npz", "-o", "/dev/full")
    assert "/dev/full: cannot be written: no space is left on the disk" in line


UP = np.tile(np.array([0.0, 0.0, 1.0], np.float32), (4, 1))
HUGE = b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (2147483648, 3), }"
DIRECTIONS: dict[str, tuple[dict[str, Any], str]] = {
    "no wi": ({"wo": UP}, "has no array wi"),
    "no wo": ({"wi": UP, "w0": UP}, "has no array wo"),
    "another shape": ({"wi": UP[:, :2], "wo": UP}, "wi has shape (4, 2), not (N, 3)"),
    "another rank": ({"wi": UP, "wo": UP[0]}, "wo has shape (3,), not (N, 3)"),
    "a place of three numbers": ({"wi": UP, "wo": UP, "uv": UP}, "uv has shape (4, 3), not (N, 2)"),
    "a footprint of two": ({"wi": UP, "wo": UP, "uv": UP[:, :2], "footprint": UP[:, :2]}, "not (N, 2, 2)"),
    "an endless place": ({"wi": UP, "wo": UP, "uv": UP[:, :2] + np.float32(np.inf)}, "uv is not finite"),
    "other numbers of them": ({"wi": UP, "wo": UP[:3]}, "its arrays have different lengths: wi 4, wo 3"),
    "integers": ({"wi": UP.astype(int), "wo": UP}, "wi is int64, not a floating-point array"),
    "objects": ({"wi": np.array([[None] * 3]), "wo": UP}, "array wi cannot be read"),
    "not a number": ({"wi": UP, "wo": np.where(np.arange(4)[:, None] == 2, np.nan, UP)}, "wo is not finite"),
    "infinite": ({"wi": UP + np.float32(np.inf), "wo": UP}, "wi is not finite"),
    "too long": ({"wi": UP, "wo": 1.01 * UP}, "wo holds a vector whose length is 0.01 off one"),
    "zero": ({"wi": UP * 0, "wo": UP}, "wi holds a vector whose length is 1 off one"),
}


@pytest.mark.parametrize("case", DIRECTIONS)
def test_bad_directions(mistake: Tell, case: str):
    arrays, fault = DIRECTIONS[case]
    np.savez("bad.npz", **arrays)
    line = mistake("eval", "gold", "--directions", "bad.npz", "-o", "out.npy")
    assert line.startswith("jaxbrdf: bad.npz: ")
    assert fault in line


def npz(path: str, name: str, content: bytes) -> bytes:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, content)
    return Path(path).read_bytes()


@pytest.mark.parametrize(
    ("case", "fault"),
    [
        ("missing", "there is no such file"),
        ("empty", "the file is empty"),
        ("text", "is not an .npz file"),
        ("one array", "is not an .npz file"),
        ("cut", "array wi cannot be read"),
        ("a claim of 2^31 vectors", "header claims the shape (2147483648, 3)"),
        ("a claim of bytes", "cannot be read"),
        ("no array inside", "array wi cannot be read"),
    ],
)
def test_directions_that_are_no_archive_of_arrays(mistake: Tell, case: str, fault: str):
    good = Path("good.npz").read_bytes()
    np.save("one.npy", UP)
    claim = npz("claim.npz", "wi.npy", HUGE.ljust(128) + bytes(96))
    files = {
        "empty": b"",
        "text": b"0 0 1\n",
        "one array": Path("one.npy").read_bytes(),
        "cut": good[:-40],
        "a claim of 2^31 vectors": claim,
        "a claim of bytes": claim.replace(struct.pack("<I", 224), struct.pack("<I", 2**31)),
        "no array inside": npz("none.npz", "wi.npy", b"hello"),
    }
    if case in files:
        Path("bad.npz").write_bytes(files[case])
    line = mistake("eval", "gold", "--directions", "bad.npz", "-o", "out.npy")
    assert line.startswith("jaxbrdf: bad.npz: ")
    assert fault in line


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        ([], "COMMAND"),
        (["fits"], "'fits'"),
        (["fit", "gold"], "-o/--output"),
        (["fit", "gold", "-o", "out", "--model", "zeltner"], "no model is called 'zeltner'; there are gated, tripl"),
        (["fit", "gold", "-o", "out", "--preset", "slow"], "no preset is called 'slow'; there are quick, standard, "),
        (["fit", "gold", "-o", "out", "--budget-seconds", "-1"], "--budget-seconds is -1.0; it must be a positive"),
        (["fit", "gold", "-o", "out", "--budget-seconds", "0"], "--budget-seconds is 0.0; it must be a positive"),
        (["fit", "gold", "-o", "out", "--budget-seconds", "nan"], "--budget-seconds is nan; it must be a positive"),
        (["fit", "gold", "-o", "out", "--budget-seconds", "inf"], "--budget-seconds is inf; it must be a positive"),
        (["fit", "gold", "-o", "out", "--budget-seconds", "soon"], "invalid float value: 'soon'"),
        (["fit", "gold", "-o", "out", "--seed", "-1"], "'-1' is not a whole number from 0"),
        (["fit", "gold", "-o", "out", "--seed", "1.5"], "'1.5' is not a whole number from 0"),
        (["fit", "gold", "-o", "out", "--seed", str(2**31)], "is not a whole number from 0 to 2147483647"),
        (["fit", "gold", "-o", "out", "--seed", "9" * 5000], "is not a whole number from 0"),
        (["fit", "gold", "-o", "out", "--precision", "float8"], "'float8'"),
        (["fit", "good.safetensors", "-o", "out"], "good.safetensors: is a bundle already"),
        (
            ["fit", "gold", "-o", "out", "--model", "nbrdf", "--budget-seconds", "-1"],
            "--budget-seconds is -1.0; it mus",
        ),
        (["fit", "gold", "-o", "out", "--max-ns", "0"], "--max-ns is 0.0; it must be a positive number"),
        (["fit", "gold", "-o", "out", "--max-ns", "nan"], "--max-ns is nan; it must be a positive number"),
        (["fit", "gold", "-o", "out", "--max-error", "-1"], "--max-error is -1.0; it must be a positive number"),
        (["fit", "gold", "-o", "out", "--max-error", "inf"], "--max-error is inf; it must be a positive number"),
        (["fit", "gold", "-o", "out", "--max-error", "small"], "invalid float value: 'small'"),
        (["fit", "gold", "-o", "out", "--metric", "mae"], "--metric says what --max-error is an error of; there is no"),
        (["fit", "gold", "-o", "out", "--max-ns", "9", "--metric", "mae"], "there is no --max-error"),
        (
            ["fit", "gold", "-o", "out", "--max-error", "1", "--metric", "psnr"],
            "no metric is called 'psnr'; there are mae",
        ),
        (
            ["fit", "gold", "-o", "out", "--max-ns", "9", "--model", "zeltner"],
            "no model is called 'zeltner'; there are",
        ),
        (["fit", "gold", "-o", "out", "--max-ns", "9", "--preset", "slow"], "no preset is called 'slow'; there are"),
        (["fit", "gold", "-o", "out", "--max-ns", "9", "--resume"], "out/bundle.candidates: no search to resume"),
        (["fit", "good.safetensors", "-o", "out", "--max-ns", "9"], "good.safetensors: is a bundle already"),
        (["pareto", "gold"], "-o/--output"),
        (["pareto", "-o", "out"], "INPUT"),
        (["pareto", "gold", "gold", "-o", "out"], "gold: is given twice"),
        (["pareto", "gold", "-o", "out", "--grid", "tiny"], "no grid is called 'tiny'; there are small, full"),
        (["pareto", "gold", "-o", "out", "--preset", "slow"], "no preset is called 'slow'; there are quick"),
        (["pareto", "gold", "-o", "out", "--budget-seconds", "0"], "--budget-seconds is 0.0; it must be a positive"),
        (
            ["pareto", "good.safetensors", "-o", "out"],
            "good.safetensors: is a bundle; to judge it, a measured file or a",
        ),
        (["bench", "gold"], "gold: is a built-in material; a bundle is needed here"),
        (["eval", "gold", "-o", "out.npy"], "--directions"),
        (["eval", "gold", "--directions", "good.npz", "-o", "out.npy", "--backend", "cuda"], "'cuda'"),
        (["eval", "gold", "--directions", "good.npz", "-o", "out.npy", "--backend", "opencl"], "gold: is a built-in"),
        (["eval", "good.bsdf", "--directions", "good.npz", "-o", "out.npy", "--backend", "opencl"], "is not a bundle"),
        (["compare", "gold", "gold"], "gold: is a built-in material; a bundle is needed here"),
        (["compare", "good.bsdf", "gold"], "good.bsdf: is not a bundle"),
        (["render", "gold", "-o", "out.jpg"], "out.jpg: a picture's name must end in .exr or .png"),
        (["render", "gold", "-o", "out.png", "--size", "0"], "'0' is not a whole number from 1"),
        (["render", "gold", "-o", "out.png", "--samples", "few"], "'few' is not a whole number from 1"),
        (["render", "gold", "-o", "out.png", "--env", "moon"], "moon: is not a light"),
        (["render", "gold", "-o", "out.png", "--env", "none.hdr"], "none.hdr: there is no such file"),
        (["render", "gold", "-o", "out.png", "--env", "good.bsdf"], "good.bsdf: is not a light"),
        (["render", "gold", "-o", "out.png", "--slant", "10"], "--slant: goes with --scene plane"),
        (["render", "gold", "-o", "out.png", "--scene", "cube"], "'cube'"),
        ([*PLANE_OF_GOLD, "--distance", "0"], "'0' is not a number from 1e-06 to 1e+06"),
        ([*PLANE_OF_GOLD, "--distance", "far"], "'far' is not a number from 1e-06 to 1e+06"),
        ([*PLANE_OF_GOLD, "--slant", "nan"], "'nan' is not a number from 0 to 89"),
        ([*PLANE_OF_GOLD, "--slant", "90"], "'90' is not a number from 0 to 89"),
        ([*PLANE_OF_GOLD, "--env", "moon"], "moon: is not a light"),
        (["convert", "gold", "out.bsdf"], "out.bsdf: a table's name must end in .binary (MERL) or .bin (UTIA)"),
        (["convert", "brushed-aluminium", "out.binary"], "brushed-aluminium: is anisotropic"),
    ],
)
def test_a_bad_request(mistake: Tell, arguments: list[str], fault: str):
    assert fault in mistake(*arguments)


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("bad.hdr", b"#?RADIANCE\n\n-Y 4 +X 8\n", ""),
        ("bad.exr", b"hello", "not an OpenEXR picture"),
        ("black.exr", exr.write(np.zeros((2, 4, 3), np.float32)), "environment is black"),
        ("negative.exr", exr.write(np.full((2, 4, 3), -1, np.float32)), "environment has negative"),
    ],
)
def test_a_bad_light(mistake: Tell, name: str, content: bytes, fault: str):
    Path(name).write_bytes(content)
    line = mistake("render", "gold", "-o", "out.png", "--env", name)
    assert line.startswith(f"jaxbrdf: {name}: ")
    assert fault in line


def test_a_sphere_of_textures(mistake: Tell):
    Path("sheet").mkdir()
    Path("sheet", "albedo.exr").write_bytes(exr.write(np.ones((2, 2, 3), np.float32)))
    assert "sheet: is a folder, and no fit's: textures are shown on a plane" in mistake(
        "render", "sheet", "-o", "a.png"
    )


WANTS_OPENCL = {
    "bench": COMMANDS["bench"]("good.safetensors"),
    "eval": COMMANDS["eval opencl"]("good.safetensors"),
    "pareto": ["pareto", "gold", "-o", "out"],
    "fit within a time": ["fit", "gold", "-o", "out", "--max-ns", "100"],
    "fit within an error": ["fit", "gold", "-o", "out", "--max-error", "0.1"],
}


@pytest.mark.parametrize("command", WANTS_OPENCL)
def test_no_opencl(mistake: Tell, monkeypatch: pytest.MonkeyPatch, command: str):
    monkeypatch.setattr(platform, "_platforms", list)
    assert "no OpenCL device found" in mistake(*WANTS_OPENCL[command])


@pytest.mark.parametrize("command", WANTS_OPENCL)
def test_an_opencl_device_that_is_not_there(mistake: Tell, monkeypatch: pytest.MonkeyPatch, command: str):
    monkeypatch.setenv(platform.CHOICE_VARIABLE, "no such maker")
    assert "no OpenCL device is named 'no such maker'" in mistake(*WANTS_OPENCL[command])


def test_two_inputs_of_one_name(mistake: Tell):
    for folder in ("a", "b"):
        Path(folder).mkdir()
        Path(folder, "made.bsdf").write_bytes(RGL)
        Path(folder, "made.safetensors").write_bytes(BUNDLE)
    assert "two materials are called made" in mistake("pareto", "a/made.bsdf", "b/made.bsdf", "-o", "out")
    twins = "a/made.safetensors", "b/made.safetensors"
    assert "two bundles are called made" in mistake("pareto", "gold", *twins, "-o", "out")


def test_a_time_that_nothing_is_within(here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """The folder is there, as it is before every fit, and nothing in it."""
    monkeypatch.setattr(price, "interleaved", lambda runs, _: {name: [0.01] for name in runs})
    monkeypatch.setattr(search, "CAPABILITY", search.CAPABILITY[:3])
    assert cli.run(["fit", "gold", "-o", "out", "--max-ns", "39"]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line == "jaxbrdf: no candidate evaluates within 39 ns: ggx-only is the fastest with 40.0 ns"
    assert list(Path("out").iterdir()) == []
