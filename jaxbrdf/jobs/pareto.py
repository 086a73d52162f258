"""What accuracy costs: a grid of candidates fitted, judged and timed alike, and which are worth their price."""

from __future__ import annotations

import functools
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.errors import FitError
from jaxbrdf.export.json_record import to_plain
from jaxbrdf.jobs import judge, price
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.entry import Entry, Failure, fitted_entries, given_entry
from jaxbrdf.jobs.folder import make_folder
from jaxbrdf.jobs.grid import grid_of
from jaxbrdf.jobs.inputs import Inputs, open_inputs
from jaxbrdf.jobs.price import Price
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.recipe import Recipe, preset_of
from jaxbrdf.jobs.reference import Reference
from jaxbrdf.jobs.store import Store
from jaxbrdf.metrics.pareto import Point, pareto_front
from jaxbrdf.opencl.parameters import stored_precision
from jaxbrdf.opencl.platform import choose, context_of, describe
from jaxbrdf.report.pareto_plot import PLOTTED, pareto_plot
from jaxbrdf.report.pareto_table import ERRORS, pareto_tables


@dataclass(frozen=True)
class ParetoConfig:
    """A comparison as the command line asks for it.

    Attributes:
        inputs: measured files, built-in materials, and bundles, which are judged by the first of the others.
        output: a folder.
        recipe: of every fit.
        grid: a key of `grid.GRIDS`.
    """

    inputs: tuple[str, ...]
    output: str
    recipe: Recipe
    grid: str = "small"


class ParetoPaths(NamedTuple):
    """The files of a comparison, and the folder of its bundles."""

    results: Path
    table: Path
    plot: Path
    bundles: Path


def pareto(config: ParetoConfig, reporter: Reporter) -> dict[str, Any]:
    """Fits what is not fitted yet, judges and times all, and writes results, table and plot; returns the results.

    Raises:
        JaxbrdfError: if an input, the output or the request cannot be used, or nothing could be fitted.
    """
    grid = grid_of(config.grid)
    preset_of(config.recipe)
    context = context_of(choose())
    inputs = open_inputs(config.inputs)
    paths = prepare(config.output, [reference.material.name for reference in inputs.references])
    entries, failures = _entries(config, grid, inputs, paths, reporter)
    if not entries:
        raise FitError(f"no candidate could be fitted: {failures[0].candidate}: {failures[0].reason}")
    reporter.say(f"timing {len(entries)} candidates on {describe(context.devices[0])}")
    timed = {f"{entry.input}: {entry.candidate}": entry.bundle for entry in entries}
    prices = price.opencl_prices(timed, context, reporter=reporter)
    rows = [row_of(entry, of, _errors(entry), paths) for entry, of in zip(entries, prices.values(), strict=True)]
    results = {
        "version": version("jaxbrdf"),
        "device": describe(context.devices[0]),
        "rounds": price.PRICE_ROUNDS,
        "grid": config.grid,
        **asdict(config.recipe),
        "metrics": ERRORS,
        "plotted": PLOTTED,
        "inputs": {r.material.name: _described(r) for r in inputs.references},
        "candidates": with_fronts(rows, ERRORS),
        "failed": [failure._asdict() for failure in failures],
    }
    write(results, paths)
    return results


def pareto_paths(output: str) -> ParetoPaths:
    """Where a comparison writes."""
    folder = Path(output)
    return ParetoPaths(*(folder / name for name in ("results.json", "table.md", "pareto.png", "bundles")))


def prepare(output: str, materials: Sequence[str]) -> ParetoPaths:
    """Makes the folders, one for the fits of each material, and tries to write, before any work is done.

    Raises:
        DataError: naming what cannot be written.
    """
    paths = pareto_paths(output)
    folders = [paths.bundles / material for material in materials]
    for folder in folders:
        make_folder(folder)
    for file in (paths.results, paths.table, paths.plot, *(folder / "candidate" for folder in folders)):
        check_writable(file)
    return paths


def with_fronts(rows: Sequence[dict[str, Any]], metrics: Collection[str]) -> list[dict[str, Any]]:
    """The rows, each with those of the metrics in whose front of its input it is."""
    done = [{**row, "front": []} for row in rows]
    for name in dict.fromkeys(row["input"] for row in done):
        of_input = [row for row in done if row["input"] == name]
        for metric in metrics:
            points = [Point(row["ns_per_evaluation"], row[metric]) for row in of_input]
            for row, is_on_it in zip(of_input, pareto_front(points), strict=True):
                row["front"] += [metric] if is_on_it else []
    return done


def _entries(
    config: ParetoConfig, grid: Sequence[Candidate], inputs: Inputs, paths: ParetoPaths, reporter: Reporter
) -> tuple[list[Entry], list[Failure]]:
    """Every candidate of every reference, and the given bundles with those of the first."""
    found: list[Entry | Failure] = []
    for place, reference in enumerate(inputs.references):
        folder = paths.bundles / reference.material.name
        draws = functools.cache(functools.partial(judge.draw, reference.material))
        found += fitted_entries(Store(folder, reference, config.recipe, draws), grid, reporter)
        found += [given_entry(given, reference, draws()) for given in inputs.bundles] if place == 0 else []
    entries = [one for one in found if isinstance(one, Entry)]
    return entries, [one for one in found if isinstance(one, Failure)]


def row_of(entry: Entry, cost: Price, errors: Mapping[str, float], paths: ParetoPaths) -> dict[str, Any]:
    """A candidate as results tell it, with these errors."""
    manifest = entry.bundle.manifest
    return {
        "input": entry.input,
        "candidate": entry.candidate,
        "model": manifest.model,
        "config": to_plain(manifest.config),
        "precision": stored_precision(entry.bundle),
        "is_fitted_here": entry.is_fitted_here,
        **cost.told,
        **errors,
        "fit_seconds": manifest.cost.get("fit_seconds"),
        "bytes": entry.file.stat().st_size,
        "bundle": entry.place_in(paths.results.parent),
    }


def _errors(entry: Entry) -> dict[str, float]:
    stored = entry.bundle.manifest.errors
    spread = {name: value for name, value in stored.items() if name.endswith("standard_error")}
    return {name: stored[at] for name, at in judge.METRICS.items()} | spread


def _described(reference: Reference) -> dict[str, Any]:
    return {"sha256": reference.source.sha256, **judge.describe_truth(reference.source)}


def write(results: dict[str, Any], paths: ParetoPaths) -> None:
    """Writes results, table and plot.

    Raises:
        DataError: naming what cannot be written.
    """
    write_atomically(paths.results, json.dumps(results, indent=1).encode())
    write_atomically(paths.table, pareto_tables(results).encode())
    write_atomically(paths.plot, pareto_plot(results))
