"""What accuracy costs over a surface: all models of texture sets fitted alike, judged on the planar scene and timed."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import FitError, JaxbrdfError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs import price
from jaxbrdf.jobs.entry import Entry, Failure
from jaxbrdf.jobs.inputs import Given, given
from jaxbrdf.jobs.pareto import prepare, row_of, with_fronts, write
from jaxbrdf.jobs.planar_judge import PlanarReference, planar_report
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.store import read_record
from jaxbrdf.jobs.surface import Surface, open_surface
from jaxbrdf.jobs.surface_config import SurfaceFitConfig
from jaxbrdf.jobs.surface_fit import errors_in, fit_surface
from jaxbrdf.jobs.surface_judge import materials_of, reference_of
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.opencl.platform import choose, context_of, describe
from jaxbrdf.report.pareto_plot import SURFACE_PLOTTED
from jaxbrdf.report.pareto_table import SURFACE_ERRORS


@dataclass(frozen=True)
class SurfaceParetoConfig:
    """A comparison over a surface as the command line asks for it.

    Attributes:
        fit: how each model is fitted; its output is the comparison's folder, its model and `resume` are not read.
        given: bundles of surfaces to set beside the fits.
    """

    fit: SurfaceFitConfig
    given: tuple[str, ...] = ()


def surface_pareto(config: SurfaceParetoConfig, reporter: Reporter) -> dict[str, Any]:
    """Fits what is not fitted yet, judges and times all, and writes results, table and plot; returns the results.

    Raises:
        JaxbrdfError: if an input, the output or the request cannot be used, or nothing could be fitted.
    """
    fit, recipe = config.fit, config.fit.recipe
    context = context_of(choose())
    surface = open_surface(fit.source, size=fit.size, normals=fit.normals, resample=fit.resample)
    beside = [_given(name) for name in config.given]
    paths = prepare(fit.output, [surface.name])
    found = [*_fitted(config.fit, surface, paths.bundles / surface.name, reporter)]
    entries = [*(one for one in found if isinstance(one, Entry)), *_judged(beside, surface)]
    failures = [one for one in found if isinstance(one, Failure)]
    if not entries:
        raise FitError(f"no model could be fitted: {failures[0].candidate}: {failures[0].reason}")
    reporter.say(f"timing {len(entries)} candidates on {describe(context.devices[0])}")
    timed = {entry.candidate: entry.bundle for entry in entries}
    query = price.timed_query_on(surface.layout)
    prices = price.opencl_prices(timed, context, reporter=reporter, query=query)
    rows = [row_of(entry, cost, _errors(entry), paths) for entry, cost in zip(entries, prices.values(), strict=True)]
    results = {
        "version": version("jaxbrdf"),
        "device": describe(context.devices[0]),
        "rounds": price.PRICE_ROUNDS,
        "preset": recipe.training.name,
        "seed": fit.seed,
        "budget_seconds": fit.budget_seconds,
        "metrics": SURFACE_ERRORS,
        "plotted": SURFACE_PLOTTED,
        "inputs": {surface.name: {"sha256": surface.sha256, "told": list(surface.told)}},
        "candidates": with_fronts(rows, SURFACE_ERRORS),
        "failed": [failure._asdict() for failure in failures],
    }
    write(results, paths)
    return results


def _given(name: str) -> Given:
    one = given(name)
    if not one.bundle.manifest.is_spatial:
        raise JaxbrdfError(f"{name}: is the same everywhere; a folder of textures is for bundles of surfaces")
    if one.name in SPATIAL:
        raise JaxbrdfError(f"{name}: is called {one.name}, as a model that is fitted here")
    return one


def _fitted(config: SurfaceFitConfig, surface: Surface, folder: Path, reporter: Reporter) -> Iterator[Entry | Failure]:
    """Every model one after the other, as it is fitted and judged."""
    for place, model in enumerate(SPATIAL, start=1):
        file = folder / f"{model}.safetensors"
        try:
            bundle = _obtained(replace(config, model=model, output=str(file)), surface, reporter)
        except FitError as error:
            reporter.say(f"{model}: {error}")
            yield Failure(surface.name, model, str(error))
            continue
        reporter.say(f"{place} of {len(SPATIAL)}, {model}: FLIP {bundle.manifest.errors['planar_flip']:.4f}")
        yield Entry(surface.name, model, bundle, file, True)


def _obtained(config: SurfaceFitConfig, surface: Surface, reporter: Reporter) -> Bundle:
    """The bundle that is there, if it is of this request; else a new one, of a fit that goes on where it was."""
    file = Path(config.output)
    request = {**asdict(replace(config, source="", output="")), "input": surface.sha256, "version": version("jaxbrdf")}
    record, running = file.with_suffix(".json"), file.with_suffix(".checkpoint")
    if read_record(record) != request:
        for stale in (file, running):
            stale.unlink(missing_ok=True)
        write_atomically(record, json.dumps(request, indent=1).encode())
    if not file.exists():
        reporter.say(f"fitting {config.model}")
        fit_surface(replace(config, resume=running.exists()), reporter)
    return bundles.load(file)


def _judged(beside: Sequence[Given], surface: Surface) -> list[Entry]:
    """Given bundles with their errors over this surface."""
    if not beside:
        return []
    reference = reference_of(surface)
    return [_judged_one(one, surface, reference) for one in beside]


def _judged_one(one: Given, surface: Surface, reference: PlanarReference) -> Entry:
    errors = errors_in(planar_report(materials_of(one.bundle, surface), reference))
    judged = one.bundle._replace(manifest=one.bundle.manifest._replace(errors=errors))
    return Entry(surface.name, one.name, judged, one.file, False)


def _errors(entry: Entry) -> dict[str, float]:
    stored = entry.bundle.manifest.errors
    pictures = {name: stored[f"planar_{name}"] for name in ("flip", "mae", "rmse")}
    values = {name: stored[name] for name in ("mae_hdr", "rmse_hdr")}
    return pictures | values | {"ssim_loss": 1.0 - stored["planar_ssim"]}
