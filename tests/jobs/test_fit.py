"""What a fit writes once it is trained; the training is put in by hand, tests/jobs/test_whole_fit.py has all of it."""

from __future__ import annotations

import errno
import json
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from jaxbrdf.brdf import builtin
from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.checks.parity import random_params
from jaxbrdf.data import output, png
from jaxbrdf.errors import DataError, FitError, OpenCLError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import finishing, judge
from jaxbrdf.jobs import fit as fit_job
from jaxbrdf.jobs.fit import fit
from jaxbrdf.jobs.fit_config import FitConfig, output_paths
from jaxbrdf.jobs.training import Task, Trained
from jaxbrdf.opencl import platform
from tests.jobs.tiny import Listener, hasten_finishing, hasten_judge

COST = {"fit_seconds": 1.5, "compile_seconds": 0.5}


@pytest.fixture
def trained(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Makes trainings end at once; what they end in is scaled by `scale`. Judgements are quick."""
    wanted = {"scale": 1.0}

    def train(task: Task, *_: Any) -> Trained:
        task.checkpoint.write_bytes(b"the state")
        params = random_params(0, task.model)
        return Trained(jax.tree.map(lambda leaf: leaf * np.float32(wanted["scale"]), params), 7, COST)

    monkeypatch.setattr(fit_job, "train", train)
    hasten_judge(partial(monkeypatch.setattr, judge))
    hasten_finishing(partial(monkeypatch.setattr, finishing))
    return wanted


def config(folder: Path, **changes: Any) -> FitConfig:
    return FitConfig("gold", str(folder / "fit"), **changes)


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / "fit").iterdir())


def test_it_leaves_a_bundle_a_report_and_a_picture(tmp_path: Path, trained: dict[str, Any]):
    del trained
    result = fit(config(tmp_path, seed=5), Listener())
    assert files(tmp_path) == ["bundle.png", "bundle.report.json", "bundle.residuals.png", "bundle.safetensors"]
    manifest = bundles.load(result.paths.bundle).manifest
    report = json.loads(result.paths.report.read_text())
    assert report == result.report
    assert (manifest.name, manifest.model, manifest.isotropic) == ("gold", "gated", True)
    assert (manifest.provenance.input, manifest.provenance.seed, manifest.provenance.steps) == ("gold", 5, 7)
    assert manifest.errors == report["errors"]
    assert manifest.cost == report["cost"]
    assert report["cost"].pop("sampler_seconds") > 0
    assert report["cost"] == COST | {"jax_ns_per_evaluation": 100.0}
    assert report["largest_albedo"] == [0.5, 0.5, 0.5]
    for picture in (result.paths.picture, result.paths.residuals):
        assert png.read(picture.read_bytes(), picture).std() > 0


def test_a_bundles_name_gives_the_names_of_the_rest(tmp_path: Path, trained: dict[str, Any]):
    del trained
    fit(FitConfig("gold", str(tmp_path / "fit" / "satin.safetensors")), Listener())
    assert files(tmp_path) == ["satin.png", "satin.report.json", "satin.residuals.png", "satin.safetensors"]


def test_errors_are_those_of_the_rounded_parameters(tmp_path: Path, trained: dict[str, Any]):
    del trained
    result = fit(config(tmp_path, precision="float16"), Listener())
    stored = bundles.material(bundles.load(result.paths.bundle))
    draws = judge.draw(symmetrised(builtin.MATERIALS["gold"]()))
    found = judge.plain_errors(judge.brdf_errors({"": stored}, draws)[""])
    assert {name: result.report["errors"][name] for name in found} == pytest.approx(found, rel=1e-5)
    single = fit(config(tmp_path), Listener()).report["errors"]
    assert single["mae"] != found["mae"]


@pytest.mark.parametrize(
    ("scale", "precision", "fault"),
    [(1e5, "float16", "store it in float32"), (np.nan, "float32", "is not finite"), (30.0, "float32", "the fit's ")],
)
def test_a_fit_that_cannot_be_stored_keeps_its_checkpoint(
    tmp_path: Path, trained: dict[str, Any], scale: float, precision: Any, fault: str
):
    trained["scale"] = scale
    with pytest.raises(FitError, match=fault) as raised:
        fit(config(tmp_path, precision=precision), Listener())
    checkpoint = output_paths(str(tmp_path / "fit")).checkpoint
    assert str(raised.value).endswith(f"the checkpoint is kept in {checkpoint}")
    assert files(tmp_path) == ["bundle.checkpoint"]


@pytest.mark.parametrize("number", [0, 1, 3])
def test_a_disk_that_fills_leaves_whole_files_and_the_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, trained: dict[str, Any], number: int
):
    """With the bundle, the report or the last picture."""
    del trained
    whole = ["bundle.safetensors", "bundle.report.json", "bundle.png", "bundle.residuals.png"]
    written = []

    def write_new(path: Path, content: bytes) -> None:
        path.write_bytes(content[: len(content) // 2 if len(written) == number else None])
        if content and len(written) == number:
            raise OSError(errno.ENOSPC, "No space left on device")
        written.extend([path] if content else [])

    monkeypatch.setattr(output, "_write_new", write_new)
    with pytest.raises(DataError, match="no space is left on the disk") as raised:
        fit(config(tmp_path), Listener())
    assert raised.value.path == str(tmp_path / "fit" / whole[number])
    assert files(tmp_path) == sorted(["bundle.checkpoint", *whole[:number]])


def test_a_fit_without_opencl_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, trained: dict[str, Any]):
    del trained
    monkeypatch.setattr(platform, "_platforms", list)
    assert "no OpenCL device found" in fit(config(tmp_path), Listener()).report["opencl_device"]


def test_a_device_that_fails_costs_no_more_than_its_time(monkeypatch: pytest.MonkeyPatch, bundle: Path):
    def fail(*_: Any, **__: Any) -> None:
        raise OpenCLError("out of memory")

    monkeypatch.setattr(judge.DeviceMaterial, "enqueue", fail)
    assert list(judge.evaluation_cost(bundles.load(bundle))) == ["jax_ns_per_evaluation"]
