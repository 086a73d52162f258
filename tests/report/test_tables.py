"""Tables in Markdown, written out by hand."""

from __future__ import annotations

import pytest

from jaxbrdf.report.tables import Column, geometric_mean, grouped, markdown, with_block

COLUMNS = (
    Column("material", "material"),
    Column("mae_ratio", "MAE", ".2f", geometric_mean),
    Column("fit_seconds", "fitting, s", ".0f", max),
    Column("never_measured", "never"),
)
ROWS = [
    {"material": "gold", "mae_ratio": 0.5, "fit_seconds": 51.2},
    {"material": "paper", "mae_ratio": 0.125, "fit_seconds": 49.0, "more": 1},
    {"material": "felt", "mae_ratio": 0.25},
]


def test_a_table_closes_with_means_and_worst_cases():
    assert markdown(ROWS, COLUMNS, closing="all").splitlines() == [
        "| material | MAE | fitting, s |",
        "| --- | ---: | ---: |",
        "| gold | 0.50 | 51 |",
        "| paper | 0.12 | 49 |",
        "| felt | 0.25 | - |",
        "| **all** | **0.25** | **51** |",
    ]


def test_a_table_of_nothing_is_refused():
    with pytest.raises(ValueError, match="rows is empty"):
        markdown([], COLUMNS)


def test_rows_are_closed_within_their_group():
    rows = [{"model": "b", "x": 2.0}, {"model": "a", "x": 5.0}, {"model": "b", "x": 8.0}]
    found = grouped(rows, "model", (Column("x", "x", ".1f", geometric_mean), Column("model", "model")))
    assert found == [{"model": "b", "x": pytest.approx(4.0)}, {"model": "a", "x": pytest.approx(5.0)}]


def test_a_block_of_a_page_is_replaced_whole_and_alone():
    page = "before\n<!-- a -->\nold\n\\1\n<!-- /a -->\nbetween\n<!-- b -->\n<!-- /b -->\n"
    found = with_block(page, "a", "| \\1 |\n")
    assert found == "before\n<!-- a -->\n| \\1 |\n<!-- /a -->\nbetween\n<!-- b -->\n<!-- /b -->\n"
    assert with_block(found, "a", "old\n\\1\n") == page
    for name in ("c", "a b"):
        with pytest.raises(ValueError, match="0 places"):
            with_block(page, name, "")
