"""A comparison of candidates as tables in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jaxbrdf.report.tables import Column, Row, markdown

ERRORS = {"smape": "SMAPE", "flip": "FLIP", "mae": "MAE", "rmse": "RMSE", "log_rmse": "log-RMSE"}
"""Metrics of one reflectance and their titles, the two that are plotted first."""

SURFACE_ERRORS = {
    "flip": "FLIP",
    "mae_hdr": "MAE of f",
    "ssim_loss": "1 - SSIM",
    "mae": "MAE",
    "rmse": "RMSE",
    "rmse_hdr": "RMSE of f",
}
"""The same over a surface: of pictures of the planar scene, and of f under random footprints."""

PRICE = (
    Column("candidate", "candidate"),
    Column("ns_per_evaluation", "ns", ".1f"),
    Column("quartiles", "quartiles", ".1f"),
)

COST = (Column("fit_seconds", "fitting, s", ".1f"), Column("bytes", "bundle, bytes", ",.0f"))


def pareto_tables(results: dict[str, Any]) -> str:
    """A table for each input, the cheapest candidate first; an error is bold where its candidate is on the front.

    Args:
        results: as `jaxbrdf pareto` writes them.
    """
    parts = [f"## {name}\n\n{_table(rows, results['metrics'])}" for name, rows in by_input(results).items()]
    failed = [f"- {one['input']}, {one['candidate']}: {one['reason']}" for one in results["failed"]]
    parts += ["## Not fitted\n\n" + "\n".join(failed) + "\n"] if failed else []
    return "\n".join([*parts, caption(results)]) + "\n"


def caption(results: dict[str, Any]) -> str:
    """What the prices were measured on, and how the candidates were fitted."""
    budget = results["budget_seconds"]
    steps = f"preset {results['preset']}" + (f" with {budget:g} s a fit" if budget else "")
    timing = f"median and quartiles of {results['rounds']} rounds over all candidates in turn"
    return (
        f"ns an evaluation by OpenCL on {results['device']}: {timing}. {steps.capitalize()}, seed {results['seed']}. "
        "Bold: on the Pareto front of error and time."
    )


def by_input(results: dict[str, Any]) -> dict[str, list[Row]]:
    """The candidates of each input that has some, the cheapest first."""
    rows = sorted(results["candidates"], key=lambda row: row["ns_per_evaluation"])
    of_inputs = {name: [row for row in rows if row["input"] == name] for name in results["inputs"]}
    return {name: of_input for name, of_input in of_inputs.items() if of_input}


def _table(rows: Sequence[Row], metrics: Mapping[str, str]) -> str:
    errors = (Column(metric, title, ".3g") for metric, title in metrics.items())
    return markdown([_shown(row) for row in rows], (*PRICE, *errors, *COST))


def _shown(row: Row) -> Row:
    lower, upper = row["ns_quartiles"]
    bold = {metric: f"**{row[metric]:.3g}**" for metric in row["front"]}
    return {**row, **bold, "quartiles": f"{lower:.1f} to {upper:.1f}"}
