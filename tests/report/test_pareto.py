"""A comparison as tables and as a plot."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from jaxbrdf.report import pareto_plot as plot_module
from jaxbrdf.report import text
from jaxbrdf.report.pareto_plot import pareto_plot
from jaxbrdf.report.pareto_table import pareto_tables
from tests.report.comparison import FULL, SMALL, comparison, row

FILES = {"results": "out/results.json", "table": "out/table.md"}


def test_a_table_has_the_cheapest_first_and_the_front_in_bold():
    heading, _, head, _, *rows, _, caption = pareto_tables(SMALL).splitlines()
    assert heading == "## gold"
    assert [cell.strip() for cell in head.split("|")][1:4] == ["candidate", "ns", "quartiles"]
    assert rows[0] == (
        "| nbrdf paper | 45.0 | 44.1 to 47.2 | **0.08** | **0.08** | 0.08 | 0.08 | 0.08 | 12.3 | 60,440 |"
    )
    assert [line.split("|")[1].strip() for line in rows] == ["nbrdf paper", "gated paper", "gated 16-16"]
    assert "**" not in rows[1]
    assert "31 rounds" in caption
    assert "Preset quick, seed 0" in caption


def test_every_input_has_a_table_and_what_failed_is_told():
    failed = [{"input": "felt", "candidate": "gated 8-8", "reason": "the fit diverged"}]
    rows = [*SMALL["candidates"], row("gated 8-8", 40.0, 0.1, [], input="felt")]
    told = pareto_tables(comparison(rows, failed=failed, budget_seconds=10.0))
    assert [line for line in told.splitlines() if line.startswith("#")] == ["## gold", "## felt", "## Not fitted"]
    assert "- felt, gated 8-8: the fit diverged" in told
    assert "Preset quick with 10 s a fit" in told


def test_a_terminal_shows_the_same():
    head, *rows, results, table = text.pareto({**SMALL, "files": FILES}).splitlines()
    assert head.split() == ["gold", "ns", "SMAPE", "FLIP", "bytes"]
    assert rows[0].split() == ["nbrdf", "paper", "45.0", "0.080000*", "0.080000*", "60,440"]
    assert rows[2].split() == ["gated", "16-16", "60.0", "0.020000*", "0.020000", "60,440"]
    assert len({len(line) for line in rows}) == 1
    assert results.split() == ["results", "out/results.json"]
    assert table.split() == ["table", "out/table.md"]


def figure_of(monkeypatch: pytest.MonkeyPatch, results: dict) -> Figure:
    figures = []
    monkeypatch.setattr(plot_module, "to_png", lambda figure: figures.append(figure) or b"")
    pareto_plot(results)
    return figures[0]


def test_a_plot_is_a_picture_and_always_the_same():
    once, again = (pareto_plot(SMALL) for _ in range(2))
    assert once == again
    with Image.open(io.BytesIO(once)) as image:
        assert image.width > 1000
        assert np.asarray(image).std() > 0


def test_a_plot_names_its_units_its_material_and_its_device(monkeypatch: pytest.MonkeyPatch):
    left, right = figure_of(monkeypatch, SMALL).axes
    assert left.get_xlabel() == right.get_xlabel() == "nanoseconds an evaluation"
    assert (left.get_ylabel(), right.get_ylabel()) == ("SMAPE of f", "FLIP of the sphere in the studio")
    assert left.get_title(loc="left") == "gold"
    assert right.get_title(loc="right") == "a device (PoCL, 3.1)"
    assert {axes.get_xscale() + axes.get_yscale() for axes in (left, right)} == {"loglog"}


def test_the_line_is_the_front(monkeypatch: pytest.MonkeyPatch):
    left, _ = figure_of(monkeypatch, SMALL).axes
    steps = [line for line in left.get_lines() if line.get_drawstyle() == "steps-post"]
    x, y = steps[0].get_data()
    assert len(steps) == 1
    np.testing.assert_allclose(x[1:-1], [45.0, 60.0])
    np.testing.assert_allclose(y[1:-1], [0.08, 0.02])


@pytest.mark.parametrize("results", [SMALL, FULL], ids=["small", "full"])
def test_points_on_the_front_are_labelled(monkeypatch: pytest.MonkeyPatch, results: dict):
    """A float16 candidate shares the label of its float32."""
    left, _ = figure_of(monkeypatch, results).axes
    sizes = {r["candidate"].partition(" ")[2].removesuffix(" float16") for r in results["candidates"]}
    wanted = sizes - {""}
    assert {label.get_text() for label in left.texts} == wanted


def test_a_comparison_of_one_candidate_and_a_given_bundle(monkeypatch: pytest.MonkeyPatch):
    rows = [row("gated paper", 50.0, 0.02, ["smape", "flip"]), row("mine", 60.0, 0.09, [], is_fitted_here=False)]
    figure = figure_of(monkeypatch, comparison(rows))
    assert [label.get_text() for label in figure.legends[0].get_texts()] == ["gated", "a given bundle", "Pareto front"]


def test_a_row_of_plots_for_each_input(monkeypatch: pytest.MonkeyPatch):
    rows = [row("gated paper", 50.0, 0.02, ["smape", "flip"], input=name) for name in ("gold", "felt")]
    axes = figure_of(monkeypatch, comparison(rows)).axes
    assert [one.get_title(loc="left") for one in axes] == ["gold", "", "felt", ""]
