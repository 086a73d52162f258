"""A comparison of candidates as a picture: error against the time of an evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from jaxbrdf.report.figure import to_png
from jaxbrdf.report.labels import Label, place_labels
from jaxbrdf.report.pareto_table import by_input
from jaxbrdf.report.tables import Row

PLOTTED = {"smape": "SMAPE of f", "flip": "FLIP of the sphere in the studio"}
SURFACE_PLOTTED = {"flip": "FLIP of the planar scene", "mae_hdr": "MAE of f under random footprints"}

COLOURS = {
    "gated": "#0072b2",
    "tripleplane": "#d55e00",
    "nbrdf": "#009e73",
    "naive-mlp": "#9a6fb0",
    "ggx-only": "#d9a441",
    "ggx": "#a07a00",
    "ggx2": "#4b4b00",
    "abc": "#56b4e9",
    "principled": "#8c564b",
    "spatial-gated": "#0072b2",
    "spatial-tripleplane": "#d55e00",
    "zeltner": "#009e73",
    "neumip": "#9a6fb0",
    "ggx-mip": "#a07a00",
}
"""Of the models; told apart by readers who confuse red and green (after Okabe and Ito)."""

SHAPES = {
    "gated": "o",
    "tripleplane": "s",
    "nbrdf": "^",
    "naive-mlp": "D",
    "ggx-only": "<",
    "ggx": "v",
    "ggx2": "P",
    "abc": "X",
    "principled": "h",
    "spatial-gated": "o",
    "spatial-tripleplane": "s",
    "zeltner": "^",
    "neumip": "D",
    "ggx-mip": "v",
}

INK, GRID, FRONT = "#222222", "#e4e4e4", "#555555"

OTHER = "#777777"
ROOM = 1.02
"""Of a mark, as a factor of its values on both axes: a single one has no range that a scale could be made of."""

TICKS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)

BELOW, ABOVE = -150.0, 30.0
"""Where labels go first: nothing lies left of and below the front."""


def pareto_plot(results: dict[str, Any]) -> bytes:
    """A PNG with a row for each input and a column for each plotted error, both axes logarithmic.

    A colour and a shape are a model, a filled mark float32 and an open one float16; a star is a bundle that was given.
    Bars are quartiles of the time. The line is the Pareto front: every other candidate has one on it that is as cheap
    and as close.

    Args:
        results: as `jaxbrdf pareto` writes them.
    """
    inputs, plotted = by_input(results), results["plotted"]
    figure = Figure(figsize=(11.0, 0.9 + 4.6 * len(inputs)), dpi=120, layout="constrained", facecolor="white")
    grid = figure.subplots(len(inputs), len(plotted), squeeze=False)
    for line, (name, rows) in zip(grid, inputs.items(), strict=True):
        for axes, (metric, title) in zip(line, plotted.items(), strict=True):
            _draw(axes, rows, metric)
            axes.set_ylabel(title, color=INK)
            axes.set_xlabel("nanoseconds an evaluation", color=INK)
        line[0].set_title(name, fontsize=12, loc="left", color=INK)
        line[-1].set_title(results["device"], fontsize=8, loc="right", color=OTHER)
    figure.legend(handles=_key(results["candidates"]), loc="outside lower center", ncols=8, frameon=False, fontsize=8)
    FigureCanvasAgg(figure)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for line, rows in zip(grid, inputs.values(), strict=True):
        for axes, metric in zip(line, plotted, strict=True):
            _label(axes, rows, metric)
    return to_png(figure)


def _draw(axes: Axes, rows: Sequence[Row], metric: str) -> None:
    axes.set(xscale="log", yscale="log")
    axes.grid(True, which="major", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=TICKS))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.margins(0.16)
    for row in rows:
        _mark(axes, row, metric)
    _draw_front(axes, [row for row in rows if metric in row["front"]], metric)


def _mark(axes: Axes, row: Row, metric: str) -> None:
    """A point with the quartiles of its time and the standard error of its error."""
    x, y, colour = row["ns_per_evaluation"], row[metric], _colour(row)
    lower, upper = row["ns_quartiles"]
    deviation = row.get(f"{metric}_standard_error", 0.0)
    bars = {"xerr": [[x - lower], [upper - x]], "yerr": deviation, "ecolor": colour, "elinewidth": 0.7, "alpha": 0.55}
    axes.errorbar(x, y, fmt="none", **bars)
    axes.update_datalim([(x / ROOM, y / ROOM), (x * ROOM, y * ROOM)])
    face = "white" if row["precision"] == "float16" else colour
    size = (7.5 if metric in row["front"] else 5.0) * (1.0 if row["is_fitted_here"] else 1.7)
    axes.plot(
        x,
        y,
        marker=SHAPES.get(row["model"], "o") if row["is_fitted_here"] else "*",
        markersize=size,
        color=colour,
        markerfacecolor=face,
        linestyle="",
        zorder=3,
    )


def _draw_front(axes: Axes, rows: Sequence[Row], metric: str) -> None:
    """Steps through the front: right of and above them a candidate is not worth its price."""
    x, y = [row["ns_per_evaluation"] for row in rows], [row[metric] for row in rows]
    right, top = axes.get_xlim()[1], axes.get_ylim()[1]
    axes.step([x[0], *x, right], [top, *y, y[-1]], where="post", color=FRONT, linewidth=1.2, zorder=2)
    axes.fill_between([*x, right], [*y, y[-1]], top, step="post", color=FRONT, alpha=0.05, linewidth=0, zorder=0)
    axes.set(xlim=(axes.get_xlim()[0], right), ylim=(axes.get_ylim()[0], top))


def _label(axes: Axes, rows: Sequence[Row], metric: str) -> None:
    """The sizes beside each point, of those on the front first; a float16 that has its float32 beside it has none."""
    names = {row["candidate"] for row in rows}
    alone = [row for row in rows if not _twin(row) or _twin(row) not in names]
    order = sorted(alone, key=lambda row: metric not in row["front"])
    sides = [BELOW if metric in row["front"] else ABOVE for row in order]
    labels = [
        Label(row["ns_per_evaluation"], row[metric], _text(row), _colour(row), side)
        for row, side in zip(order, sides, strict=True)
        if _text(row)
    ]
    place_labels(axes, labels, [(row["ns_per_evaluation"], row[metric]) for row in rows])


def _twin(row: Row) -> str:
    """The name of the same in float32, or nothing."""
    name, _, precision = row["candidate"].rpartition(" ")
    return name if precision == "float16" else ""


def _text(row: Row) -> str:
    """The candidate's name without what colour and mark say: nothing of a model without sizes."""
    return (_twin(row) or row["candidate"]).removeprefix(row["model"]).strip()


def _colour(row: Row) -> str:
    return COLOURS.get(row["model"], OTHER)


def _key(rows: Sequence[Row]) -> list[Line2D]:
    models = [name for name in COLOURS if any(row["model"] == name for row in rows)]
    marks = [Line2D([], [], color=COLOURS[name], marker=SHAPES[name], linestyle="", label=name) for name in models]
    if any(row["precision"] == "float16" for row in rows):
        marks.append(Line2D([], [], color=OTHER, marker="o", markerfacecolor="white", linestyle="", label="float16"))
    if not all(row["is_fitted_here"] for row in rows):
        marks.append(Line2D([], [], color=OTHER, marker="*", markersize=9, linestyle="", label="a given bundle"))
    return [*marks, Line2D([], [], color=FRONT, linewidth=1.2, label="Pareto front")]
