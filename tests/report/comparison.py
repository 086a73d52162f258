"""A comparison as `jaxbrdf pareto` writes it, made up."""

from __future__ import annotations

from typing import Any

from jaxbrdf.jobs.grid import GRIDS
from jaxbrdf.report.pareto_plot import PLOTTED
from jaxbrdf.report.pareto_table import ERRORS


def row(candidate: str, ns: float, error: float, front: list[str], **more: Any) -> dict[str, Any]:
    """A candidate whose errors are all the same."""
    return {
        "input": "gold",
        "candidate": candidate,
        "model": candidate.split(" ")[0],
        "precision": "float16" if candidate.endswith("float16") else "float32",
        "is_fitted_here": True,
        "ns_per_evaluation": ns,
        "ns_quartiles": [0.98 * ns, 1.05 * ns],
        **dict.fromkeys(ERRORS, error),
        "smape_standard_error": 0.01 * error,
        "fit_seconds": 12.34,
        "bytes": 60_440,
        "front": front,
        **more,
    }


def comparison(rows: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    """The results with these candidates."""
    return {
        "device": "a device (PoCL, 3.1)",
        "rounds": 31,
        "preset": "quick",
        "budget_seconds": None,
        "seed": 0,
        "metrics": ERRORS,
        "plotted": PLOTTED,
        "inputs": dict.fromkeys(row["input"] for row in rows),
        "candidates": rows,
        "failed": [],
        **more,
    }


SMALL = comparison(
    [
        row("gated 16-16", 60.0, 0.02, ["smape"]),
        row("nbrdf paper", 45.0, 0.08, ["smape", "flip"]),
        row("gated paper", 50.0, 0.09, []),
    ]
)
FULL = comparison([row(c.name, 40.0 + 3 * i, 0.5 * 0.85**i, ["smape", "flip"]) for i, c in enumerate(GRIDS["full"])])
