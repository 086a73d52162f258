"""A comparison over a texture set from end to end: trainings are pretended, the rest is real but small."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jaxbrdf import cli
from jaxbrdf.data import png
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import price, surface_fit, surface_judge
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.report.pareto_table import SURFACE_ERRORS
from tests.jobs.tiny import pretend_to_train, run_json
from tests.surface.relief import write_relief

SIZE = 16

COMPARED = ("tripleplane", "ggx-mip")
"""Of the table of models; the fits of the others are no different here."""


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, list[str], dict[str, Any]]]:
    """The folder of a texture set beside which `out` holds a comparison, the trainings of it, and what it found."""
    folder = tmp_path_factory.mktemp("sets") / "relief"
    write_relief(folder, SIZE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(price, "QUERIES", 2**10)
        for name in SPATIAL.keys() - COMPARED:
            patch.delitem(SPATIAL, name)
        for name, value in {"SIZE": 12, "SCALES": 2, "SAMPLES": 4, "DRAWS": 2**9}.items():
            patch.setattr(surface_judge, name, value)
        trainings = pretend_to_train(partial(patch.setattr, surface_fit, raising=False))
        assert cli.run(["pareto", str(folder), "-o", str(folder.parent / "out")]) == 0
        yield folder, trainings, json.loads((folder.parent / "out" / "results.json").read_bytes())


def test_every_model_is_fitted_judged_and_timed(compared: tuple[Path, list[str], dict[str, Any]]):
    folder, trainings, found = compared
    out = folder.parent / "out"
    assert trainings == list(COMPARED)
    assert [row["candidate"] for row in found["candidates"]] == list(COMPARED)
    for row in found["candidates"]:
        lower, upper = row["ns_quartiles"]
        assert 0 < lower <= row["ns_per_evaluation"] <= upper
        manifest = bundles.load(out / row["bundle"]).manifest
        assert (manifest.model, manifest.errors["planar_flip"]) == (row["model"], row["flip"])
        assert row["ssim_loss"] == pytest.approx(1.0 - manifest.errors["planar_ssim"])
        assert np.all(np.isfinite([row[metric] for metric in SURFACE_ERRORS]))
    for metric in SURFACE_ERRORS:
        assert any(metric in row["front"] for row in found["candidates"])
    assert (out / "table.md").read_text().startswith("## relief\n")
    assert png.read((out / "pareto.png").read_bytes(), "plot").std() > 0


def test_what_is_fitted_is_not_fitted_again_and_a_bundle_stands_beside_it(
    compared: tuple[Path, list[str], dict[str, Any]],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
):
    folder, trainings, first = compared
    out = folder.parent / "out"
    monkeypatch.delitem(SPATIAL, "tripleplane")
    given = folder.parent / "mine.safetensors"
    given.write_bytes((out / "bundles" / "relief" / "tripleplane.safetensors").read_bytes())
    again = run_json(capsys, "pareto", folder, given, "-o", out)
    assert trainings == list(COMPARED)
    fitted, beside = again["candidates"]
    want = {row["candidate"]: row for row in first["candidates"]}
    assert (fitted["candidate"], fitted["flip"]) == ("ggx-mip", want["ggx-mip"]["flip"])
    assert (beside["candidate"], beside["is_fitted_here"]) == ("mine", False)
    assert beside["flip"] == pytest.approx(want["tripleplane"]["flip"])
    run_json(capsys, "pareto", folder, "-o", out, "--seed", "1")
    assert trainings == [*COMPARED, "ggx-mip"]


@pytest.mark.parametrize(
    ("inputs", "fault"),
    [
        (["{folder}", "--grid", "full"], "--grid is not for a folder of textures"),
        (["{folder}", "{other}"], "one texture set is compared at a time"),
        (["{folder}", "gold"], "gold: "),
        (["gold", "--size", "8"], "--size is only for a folder of textures"),
    ],
)
def test_what_cannot_be_compared_is_told(
    compared: tuple[Path, list[str], dict[str, Any]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    inputs: list[str],
    fault: str,
):
    names = [word.format(folder=compared[0], other=compared[0].parent) for word in inputs]
    assert cli.run(["pareto", *names, "-o", str(tmp_path / "out")]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert fault in line
    assert not (tmp_path / "out").exists()
