"""A comparison from end to end: trainings are pretended, the rest is real but small."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from jaxbrdf import cli
from jaxbrdf.data import png
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import grid, judge, pareto, price, store
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.pareto import with_fronts
from tests.jobs.tiny import hasten_judge, let_diverge, pretend_to_train, run_json

GRID = (Candidate("nbrdf"), Candidate("gated"), Candidate("gated", precision="float16"))
NAMES = [candidate.name for candidate in GRID]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own, and a grid of three."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(grid.GRIDS, "small", GRID)
    monkeypatch.setattr(price, "QUERIES", 2**10)
    hasten_judge(partial(monkeypatch.setattr, judge))
    return tmp_path


@pytest.fixture(autouse=True)
def trainings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    return pretend_to_train(partial(monkeypatch.setattr, store))


def test_it_writes_results_a_table_a_plot_and_the_bundles(capsys: pytest.CaptureFixture[str], trainings: list[str]):
    found = run_json(capsys, "pareto", "gold", "-o", "out", "--seed", "5")
    assert trainings == ["nbrdf-paper", "gated-paper"]
    files = found.pop("files")
    assert json.loads(Path(files["results"]).read_bytes()) == found
    assert Path(files["table"]).read_text().startswith("## gold\n")
    assert png.read(Path(files["plot"]).read_bytes(), "plot").std() > 0
    assert files["bundles"] == str(Path("out", "bundles"))
    assert [row["candidate"] for row in found["candidates"]] == NAMES
    assert (found["grid"], found["preset"], found["budget_seconds"], found["seed"]) == ("small", "quick", None, 5)
    assert found["inputs"]["gold"]["isotropic"] is True


def test_a_row_has_errors_prices_and_sizes(capsys: pytest.CaptureFixture[str]):
    rows = run_json(capsys, "pareto", "gold", "-o", "out")["candidates"]
    for row in rows:
        least, most = row["ns_spread"]
        lower, upper = row["ns_quartiles"]
        assert 0 < least <= lower <= row["ns_per_evaluation"] <= upper <= most
        assert row["fit_seconds"] == 1.5
        path = Path("out", row["bundle"])
        assert row["bytes"] == path.stat().st_size
        manifest = bundles.load(path).manifest
        assert manifest.errors["smape"] == row["smape"]
        assert manifest.errors["image_flip"] == row["flip"]
        assert row["smape_standard_error"] > 0
    assert [row["precision"] for row in rows] == ["float32", "float32", "float16"]
    assert rows[2]["bytes"] < 0.6 * rows[1]["bytes"]
    assert rows[1]["config"]["hidden"] == [12, 12]
    for metric in judge.METRICS:
        assert any(metric in row["front"] for row in rows)


def test_what_is_fitted_is_not_fitted_again(capsys: pytest.CaptureFixture[str], trainings: list[str]):
    first = run_json(capsys, "pareto", "gold", "-o", "out")
    again = run_json(capsys, "pareto", "gold", "glazed-ceramic", "-o", "out")
    assert trainings == 2 * ["nbrdf-paper", "gated-paper"]
    errors = [[row["smape"] for row in result["candidates"][:3]] for result in (first, again)]
    assert errors[0] == errors[1]
    run_json(capsys, "pareto", "gold", "-o", "out", "--seed", "1")
    assert len(trainings) == 6


def test_several_inputs_have_fronts_of_their_own(capsys: pytest.CaptureFixture[str]):
    found = run_json(capsys, "pareto", "gold", "glazed-ceramic", "-o", "out")
    assert [(row["input"], row["candidate"]) for row in found["candidates"]] == [
        (name, candidate) for name in ("gold", "glazed-ceramic") for candidate in NAMES
    ]
    for name in ("gold", "glazed-ceramic"):
        rows = [row for row in found["candidates"] if row["input"] == name]
        assert any("smape" in row["front"] for row in rows)
    assert Path("out", "bundles", "glazed-ceramic", "gated-paper.safetensors").is_file()


def test_a_given_bundle_is_judged_by_the_first_material(capsys: pytest.CaptureFixture[str], bundle: Path):
    found = run_json(capsys, "pareto", bundle, "glazed-ceramic", "gold", "-o", "out")
    given = [row for row in found["candidates"] if not row["is_fitted_here"]]
    assert [(row["input"], row["candidate"]) for row in given] == [("glazed-ceramic", bundle.parent.name)]
    assert given[0]["bundle"] == str(bundle)
    assert given[0]["fit_seconds"] is None
    compared = run_json(capsys, "compare", bundle, "glazed-ceramic")
    assert given[0]["smape"] == pytest.approx(compared["bundle"]["smape"])


def test_a_candidate_that_diverges_is_left_out_and_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    let_diverge(monkeypatch, "gated-paper")
    found = run_json(capsys, "pareto", "gold", "-o", "out")
    assert [row["candidate"] for row in found["candidates"]] == ["nbrdf paper"]
    assert [(one["candidate"], one["reason"]) for one in found["failed"]] == [
        (name, "the fit diverged") for name in NAMES[1:]
    ]
    assert "- gold, gated paper: the fit diverged" in Path("out", "table.md").read_text()
    monkeypatch.setitem(grid.GRIDS, "small", GRID[1:])
    assert cli.run(["pareto", "gold", "-o", "other"]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line == "jaxbrdf: no candidate could be fitted: gated paper: the fit diverged"


def test_an_interruption_leaves_what_is_finished_and_says_how_to_go_on(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, trainings: list[str]
):
    pretended = store.train

    def train(task: Any, *others: Any) -> Any:
        if task.checkpoint.stem == "gated-paper":
            raise KeyboardInterrupt
        return pretended(task, *others)

    monkeypatch.setattr(store, "train", train)
    assert cli.run(["pareto", "gold", "-o", "my out", "--budget-seconds", "5"]) == 130
    *_, kept, line, last = capsys.readouterr().err.splitlines()
    assert (kept, last) == ("what is fitted is kept; to go on:", "jaxbrdf: interrupted")
    assert line == "  jaxbrdf pareto gold -o 'my out' --preset quick --seed 0 --budget-seconds 5.0"
    assert not Path("my out", "results.json").exists()
    monkeypatch.setattr(store, "train", pretended)
    assert cli.run(["pareto", "gold", "-o", "my out", "--budget-seconds", "5"]) == 0
    assert trainings == ["nbrdf-paper", "gated-paper"]
    told = capsys.readouterr()
    assert "gold 3 of 3, gated paper float16: SMAPE" in told.err
    assert "my out/pareto.png" in told.out


def test_nothing_is_promised_where_nothing_was_begun(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pareto, "open_inputs", interrupt)
    assert cli.run(["pareto", "gold", "-o", "out"]) == 130
    assert capsys.readouterr().err == "jaxbrdf: interrupted\n"
    assert not Path("out").exists()


def test_fronts_are_of_each_input_and_each_metric():
    def row(name: str, ns: float, smape: float, flip: float) -> dict[str, Any]:
        return {"input": name, "ns_per_evaluation": ns, **dict.fromkeys(judge.METRICS, smape), "flip": flip}

    rows = [row("a", 10, 0.2, 0.1), row("a", 20, 0.1, 0.3), row("b", 30, 0.9, 0.9)]
    others = ["mae", "smape", "rmse", "log_rmse"]
    assert [row["front"] for row in with_fronts(rows, judge.METRICS)] == [[*others, "flip"], others, [*others, "flip"]]
