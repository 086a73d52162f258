"""The cheapest model that meets a budget; trainings, judgements and prices are put in by hand."""

from __future__ import annotations

import dataclasses
import json
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from jaxbrdf import cli
from jaxbrdf.errors import BudgetError, FitError, JaxbrdfError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle, Precision
from jaxbrdf.jobs import finishing, fit, fitting, judge, price, search, store
from jaxbrdf.jobs.budget import Budget, Rejected, check_budget, within_price
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.fit import FitResult
from jaxbrdf.jobs.fit_config import FitConfig
from jaxbrdf.jobs.grid import ANALYTIC, CAPABILITY
from jaxbrdf.jobs.price import Price
from jaxbrdf.opencl.parameters import stored_precision
from jaxbrdf.types import Material
from tests.jobs.tiny import (
    NO_RESIDUALS,
    PICTURES,
    Listener,
    hasten_finishing,
    hasten_judge,
    let_diverge,
    pretend_to_train,
    run_json,
)

NAIVE, NBRDF, PAPER, OWN = Candidate("naive-mlp"), Candidate("nbrdf"), Candidate("gated"), Candidate("gated", (16, 16))
GRID = (NAIVE, NBRDF, PAPER, OWN)
GGX = Candidate("ggx")
NS = {"ggx": 3.0, "naive-mlp paper": 40.0, "nbrdf paper": 20.0, "gated paper": 30.0, "gated 16-16": 60.0}
ERRORS = {"ggx": 0.5, "naive-mlp paper": 0.4, "nbrdf paper": 0.2, "gated paper": 0.1, "gated 16-16": 0.05}


def size(params: Any) -> int:
    return sum(np.size(leaf) for leaf in jax.tree.leaves(params))


SIZES = {size(fitting.unfitted(c, isotropic=True).params): c for c in (GGX, *GRID)}


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own, four candidates, and their prices and errors."""

    def opencl_prices(bundles: dict[str, Bundle], *_: Any, **__: Any) -> dict[str, Price]:
        return {name: Price(NS[name.removesuffix(" float16")], 1.0, 2.0, 98.0, 99.0) for name in bundles}

    def judgement(fit: Material, _: Any) -> judge.Judgement:
        candidate = SIZES[size(fit.params)]
        error = ERRORS[candidate.name]
        errors = {"smape": error, "mae": 2 * error, "rmse": error, "log_rmse": error, "image_flip": 0.125 * error}
        return judge.Judgement(errors | {f"{name}_standard_error": 0.0 for name in errors}, PICTURES, NO_RESIDUALS)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(search, "CAPABILITY", GRID)
    monkeypatch.setattr(price, "opencl_prices", opencl_prices)
    hasten_judge(partial(monkeypatch.setattr, judge))
    hasten_finishing(partial(monkeypatch.setattr, finishing))
    monkeypatch.setattr(judge, "draw", lambda _: None)
    monkeypatch.setattr(judge, "judgement", judgement)
    return tmp_path


@pytest.fixture(autouse=True)
def trainings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    return pretend_to_train(partial(monkeypatch.setattr, store))


def searched(budget: Budget, **changes: Any) -> FitResult:
    return search.search(FitConfig("gold", "out", **changes), budget, Listener())


def rejected(result: FitResult) -> dict[str, tuple[float, float | None, str]]:
    return {one["candidate"]: (one["ns"], one["error"], one["reason"]) for one in result.report["rejected"]}


def files() -> list[str]:
    return sorted(path.name for path in Path("out").iterdir())


def test_a_time_alone_takes_the_most_capable_within_it_and_fits_only_that(trainings: list[str]):
    result = searched(Budget(max_ns=50.0))
    assert trainings == ["gated-paper"]
    assert result.report["candidate"] == "gated paper"
    assert rejected(result) == {
        "naive-mlp paper": (40.0, None, "less capable than gated paper"),
        "nbrdf paper": (20.0, None, "less capable than gated paper"),
        "gated 16-16": (60.0, None, "above 50 ns"),
    }


def test_an_error_alone_goes_from_the_cheapest_to_the_first_that_meets_it(trainings: list[str]):
    result = searched(Budget(max_error=0.1))
    assert trainings == ["nbrdf-paper", "gated-paper"]
    assert rejected(result) == {
        "nbrdf paper": (20.0, 0.2, "smape above 0.1"),
        "naive-mlp paper": (40.0, None, "dearer than gated paper: not fitted"),
        "gated 16-16": (60.0, None, "dearer than gated paper: not fitted"),
    }


def test_both_together(trainings: list[str]):
    result = searched(Budget(max_ns=35.0, max_error=0.15))
    assert trainings == ["nbrdf-paper", "gated-paper"]
    assert rejected(result)["gated 16-16"] == (60.0, None, "above 35 ns")
    assert rejected(result)["nbrdf paper"] == (20.0, 0.2, "smape above 0.15")


@pytest.mark.parametrize(("metric", "bound", "taken"), [("mae", 0.2, "gated paper"), ("flip", 0.025, "nbrdf paper")])
def test_the_metric_decides(metric: str, bound: float, taken: str):
    assert searched(Budget(max_error=bound, metric=metric)).report["candidate"] == taken


def test_what_is_written_is_what_a_fit_writes():
    """And nothing of the search is left."""
    result = searched(Budget(max_error=0.1), seed=5)
    assert files() == ["bundle.png", "bundle.report.json", "bundle.residuals.png", "bundle.safetensors"]
    report = json.loads(result.paths.report.read_text())
    assert report == result.report
    assert report["budget"] == {"max_ns": None, "max_error": 0.1, "metric": "smape", "model": None}
    assert (report["config"]["model"], report["config"]["paper_sizes"], report["config"]["seed"]) == ("gated", True, 5)
    assert report.keys() >= {"errors", "cost", "source", "opencl_device", "candidate", "rejected"}
    manifest = bundles.load(result.paths.bundle).manifest
    assert (manifest.model, manifest.errors, manifest.provenance.seed) == ("gated", report["errors"], 5)
    assert manifest.config == PAPER.sizes(isotropic=True)


@pytest.mark.parametrize("precision", ["float32", "float16"])
def test_the_cheapest_may_be_an_analytic_model(
    monkeypatch: pytest.MonkeyPatch, trainings: list[str], precision: Precision
):
    monkeypatch.setattr(search, "CAPABILITY", (GGX, *GRID))
    monkeypatch.setattr(fit, "uncertainty", lambda problem, params: {"parameters": sorted(params._asdict())})
    taken = searched(Budget(max_error=0.6), precision=precision)
    assert trainings == ["ggx"]
    assert (taken.report["candidate"], taken.report["parameters"]) == ("ggx", ["albedo", "lobes"])
    assert (taken.report["config"]["model"], taken.report["config"]["paper_sizes"]) == ("ggx", False)
    assert bundles.load(taken.paths.bundle).manifest.provenance.preset == "least-squares"
    assert searched(Budget(max_ns=5.0), precision=precision).report["candidate"] == "ggx"
    dearer = searched(Budget(max_error=0.2), precision=precision)
    assert rejected(dearer)["ggx"] == (3.0, 0.5, "smape above 0.2")
    assert "parameters" not in dearer.report


def test_a_model_and_the_papers_sizes_restrict_the_choice(trainings: list[str]):
    assert searched(Budget(max_ns=99.0, model="nbrdf")).report["rejected"] == []
    assert list(rejected(searched(Budget(max_ns=99.0, model="gated")))) == ["gated paper"]
    assert searched(Budget(max_ns=99.0), paper_sizes=True).report["candidate"] == "gated paper"
    assert trainings == ["nbrdf-paper", "gated-16-16", "gated-paper"]


def test_the_precision_is_that_of_the_bundle():
    result = searched(Budget(max_error=0.1), precision="float16")
    assert result.report["candidate"] == "gated paper float16"
    assert next(iter(rejected(result))) == "nbrdf paper float16"
    assert stored_precision(bundles.load(result.paths.bundle)) == "float16"


def test_where_none_is_close_enough_the_fits_stay_and_no_bundle_is_written(trainings: list[str]):
    with pytest.raises(BudgetError) as raised:
        searched(Budget(max_ns=50.0, max_error=0.05))
    file = Path("out", "bundle.candidates", "gated-paper.safetensors")
    assert str(raised.value) == (
        "no candidate reaches smape 0.05: gated paper is closest with 0.1 at 30.0 ns, "
        f"kept in {file}; with another budget, --resume takes it as it is"
    )
    assert files() == ["bundle.candidates"]
    assert bundles.load(file).manifest.errors["smape"] == 0.1
    assert len(trainings) == 3
    result = searched(Budget(max_ns=50.0, max_error=0.1), resume=True)
    assert len(trainings) == 3
    assert result.report["candidate"] == "gated paper"
    assert files() == ["bundle.png", "bundle.report.json", "bundle.residuals.png", "bundle.safetensors"]


def test_without_resuming_it_begins_anew(trainings: list[str]):
    for _ in range(2):
        with pytest.raises(BudgetError):
            searched(Budget(max_error=0.01))
    assert len(trainings) == 2 * len(GRID)


def test_a_resumed_search_keeps_its_prices(monkeypatch: pytest.MonkeyPatch):
    """They would be a little different, and so might be the order and the choice."""
    with pytest.raises(BudgetError):
        searched(Budget(max_error=0.01))
    monkeypatch.setattr(price, "opencl_prices", lambda *_, **__: pytest.fail("timed again"))
    with pytest.raises(BudgetError):
        searched(Budget(max_ns=30.0, max_error=0.01), resume=True)
    with pytest.raises(
        BudgetError, match=r"no candidate evaluates within 1 ns: nbrdf paper is the fastest with 20.0 ns"
    ):
        searched(Budget(max_ns=1.0), resume=True)
    assert len(list(Path("out", "bundle.candidates").glob("*.safetensors"))) == 4


def test_other_candidates_are_timed(monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(BudgetError):
        searched(Budget(max_error=0.01))
    with pytest.raises(BudgetError):
        searched(Budget(max_error=0.01, model="gated"), resume=True)
    kept = json.loads(Path("out", "bundle.candidates", "prices.json").read_bytes())
    assert list(kept["prices"]) == ["gated paper", "gated 16-16"]


def test_a_candidate_that_diverges_is_passed_over(monkeypatch: pytest.MonkeyPatch):
    let_diverge(monkeypatch, "nbrdf-paper")
    result = searched(Budget(max_error=0.3))
    assert rejected(result)["nbrdf paper"] == (20.0, None, "the fit diverged")
    assert result.report["candidate"] == "gated paper"
    with pytest.raises(FitError, match="no candidate could be fitted: nbrdf paper: the fit diverged"):
        searched(Budget(max_error=0.3, model="nbrdf"))


def test_a_bundles_name_gives_the_names_of_the_rest():
    with pytest.raises(BudgetError, match=r"out/satin\.candidates/gated-16-16\.safetensors"):
        search.search(FitConfig("gold", "out/satin.safetensors"), Budget(max_error=0.01), Listener())
    search.search(FitConfig("gold", "out/satin.safetensors"), Budget(max_error=0.2), Listener())
    assert files() == ["satin.png", "satin.report.json", "satin.residuals.png", "satin.safetensors"]


def test_the_command_tells_it_as_text_and_as_json(capsys: pytest.CaptureFixture[str]):
    arguments = ["fit", "gold", "-o", "out", "--max-error", "0.025", "--metric", "flip", "--max-ns", "50"]
    found = run_json(capsys, *arguments)
    assert found["candidate"] == "nbrdf paper"
    assert found["files"].keys() == {"bundle", "report", "picture", "residuals"}
    assert {one["candidate"] for one in found["rejected"]} == {"naive-mlp paper", "gated paper", "gated 16-16"}


def test_an_interrupted_search_says_how_to_go_on(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(store, "train", interrupt)
    assert (
        cli.run(["fit", "gold", "-o", "out", "--max-error", "0.02", "--model", "gated", "--budget-seconds", "5"]) == 130
    )
    *_, kept, line, last = capsys.readouterr().err.splitlines()
    assert (kept, last) == ("what is fitted is kept; to go on:", "jaxbrdf: interrupted")
    options = "--model gated --preset quick --seed 0 --precision float32 --budget-seconds 5.0 --max-error 0.02 --resume"
    assert line == f"  jaxbrdf fit gold -o out {options}"
    monkeypatch.undo()
    assert callable(cli.parser().parse_args(line.split()[1:]).run)


@pytest.mark.parametrize(
    ("budget", "fault"),
    [
        (Budget(max_ns=0.0), "--max-ns is 0.0"),
        (Budget(max_error=float("nan")), "--max-error is nan"),
        (Budget(max_error=1.0, metric="psnr"), "no metric is called 'psnr'"),
        (Budget(max_ns=1.0, model="zeltner"), "no model is called 'zeltner'"),
    ],
)
def test_a_budget_that_is_none(budget: Budget, fault: str):
    with pytest.raises(JaxbrdfError, match=fault):
        check_budget(budget)


def test_candidates_within_a_time_keep_their_order():
    prices = {name: Price(*[ns] * 5) for name, ns in NS.items()}
    assert within_price(GRID, prices, None) == (list(GRID), [])
    assert within_price(GRID, prices, 30.0) == (
        [NBRDF, PAPER],
        [Rejected("naive-mlp paper", 40.0, None, "above 30 ns"), Rejected("gated 16-16", 60.0, None, "above 30 ns")],
    )
    with pytest.raises(BudgetError, match=r"within 19\.5 ns: nbrdf paper is the fastest with 20\.0"):
        within_price(GRID, prices, 19.5)


def test_the_choice_is_from_the_whole_order_of_capability(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(search, "CAPABILITY", CAPABILITY)
    left = search.considered(FitConfig("gold", "out", precision="float16"), Budget(max_ns=1.0))
    assert left == [dataclasses.replace(c, precision="float16") for c in CAPABILITY]
    widths = [len(c.hidden or ()) for c in search.considered(FitConfig("gold", "out", paper_sizes=True), Budget())]
    assert widths == [0] * (4 + len(ANALYTIC))
