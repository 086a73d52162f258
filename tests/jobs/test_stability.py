"""`jaxbrdf stability`: the last line counts, the exit code tells, and a file that is not sound fails."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import safetensors
import safetensors.numpy

from jaxbrdf import cli
from jaxbrdf.checks.suite import Verdict
from jaxbrdf.jobs import stability as job

ALL_WELL = [Verdict("finite", True, 0.0, 0.0, ""), Verdict("energy", None, 0.9, np.nan, "viewer at 0 degrees")]


@pytest.fixture
def planted(tmp_path: Path, bundle: Path) -> Path:
    """The bundle with one texel that is not a number."""
    tensors, path = safetensors.numpy.load_file(bundle), tmp_path / "planted.safetensors"
    with safetensors.safe_open(bundle, "numpy") as opened:
        metadata = opened.metadata()
    tensors["h"] = tensors["h"].copy()
    tensors["h"].flat[7] = np.nan
    safetensors.numpy.save_file(tensors, path, metadata=metadata)
    return path


def test_a_bundle_with_a_planted_nan_fails(planted: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.run(["stability", str(planted)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "checks: 0 passed, 1 failed"
    assert "h is not finite" in lines[-2]


def test_a_file_that_is_not_there_is_a_mistake(capsys: pytest.CaptureFixture[str]):
    assert cli.run(["stability", "none.safetensors"]) == 2
    assert "none.safetensors" in capsys.readouterr().err


@pytest.mark.parametrize(("more", "code"), [([], 0), ([Verdict("sampler", False, 0.0, 1e-3, "")], 1)])
def test_the_exit_code_is_that_of_the_checks(
    more: list[Verdict], code: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(job, "run_checks", lambda *_, **__: ALL_WELL + more)
    assert cli.run(["stability", "gold"]) == code
    assert capsys.readouterr().out.splitlines()[-1] == f"checks: 1 passed, {len(more)} failed"


def test_a_fitted_bundle_passes(bundle: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.run(["stability", str(bundle)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1].endswith(", 0 failed")
    assert any(line.startswith("opencl       passed") for line in lines)
