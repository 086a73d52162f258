"""Fit a material: draw, train, judge, export, and lay a picture beside the reference."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, NamedTuple

from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import FitError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.finishing import Finished, finished
from jaxbrdf.jobs.fit_config import FitConfig, FitPaths, SurfacePaths, output_paths, prepare_output
from jaxbrdf.jobs.fitting import Judged, bundle_of, problem_of, solved, task_of
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.reference import Reference, open_reference
from jaxbrdf.jobs.solving import uncertainty
from jaxbrdf.jobs.training import train
from jaxbrdf.report.pictures import side_by_side
from jaxbrdf.report.residuals import residual_picture

NOTED_ERRORS = (("image_flip", "FLIP"), ("mae", "MAE"), ("smape", "SMAPE"), ("rmse", "RMSE"))


class FitResult(NamedTuple):
    """What a fit leaves behind.

    Attributes:
        paths: of its files.
        report: as written in the report's file.
    """

    paths: FitPaths | SurfacePaths
    report: dict[str, Any]


def fit(config: FitConfig, reporter: Reporter) -> FitResult:
    """Fits `config.source` and writes bundle, report and pictures; the checkpoint goes when they are there.

    Raises:
        JaxbrdfError: if the input, the output or the request cannot be used, or the training diverges.
    """
    candidate, recipe = config.candidate, config.recipe
    reference = open_reference(config.source)
    paths = output_paths(config.output)
    prepare_output(paths)
    if candidate.is_analytic:
        trained = solved(candidate, reference, recipe, reporter)
    else:
        task = task_of(candidate, reference, recipe, paths.checkpoint)
        trained = train(task, config.budget_seconds, config.resume, reporter)
    bundle = bundle_of(candidate, reference, recipe, trained)
    try:
        done = finished(bundle, config, judge.draw(reference.material), reporter)
    except FitError as error:
        raise FitError(f"{paths.bundle}: {error}; the checkpoint is kept in {paths.checkpoint}") from None
    result = write_fit(config, reference, done, paths, more=trained.findings)
    paths.checkpoint.unlink(missing_ok=True)
    return result


def write_fit(
    config: FitConfig, reference: Reference, done: Finished, paths: FitPaths, *, more: Mapping[str, Any] | None = None
) -> FitResult:
    """Writes a fit's files, and what an evaluation costs into bundle and report.

    Args:
        config: as the report has it.
        reference: what was fitted.
        done: the fit.
        paths: of its files.
        more: further entries of the report.

    Raises:
        DataError: if a file cannot be written.
    """
    judged, manifest = done.judged, done.judged.bundle.manifest
    cost = manifest.cost | judge.evaluation_cost(judged.bundle)
    report = {
        "config": asdict(config),
        "errors": manifest.errors,
        "cost": cost,
        "opencl_device": judge.opencl_device(),
        "source": judge.describe_truth(reference.source),
    }
    if config.candidate.is_analytic:
        report |= uncertainty(problem_of(config.candidate, reference, config.recipe), judged.bundle.params)
    report |= done.findings | dict(more or {})
    bundle = judged.bundle._replace(manifest=manifest._replace(cost=cost))
    bundles.save(paths.bundle, bundle, precision=config.precision)
    write_atomically(paths.report, json.dumps(report, indent=1).encode())
    write_atomically(paths.picture, _picture(judged))
    write_atomically(paths.residuals, residual_picture(judged.judgement.residuals, title=_title(judged)))
    return FitResult(paths, report)


def _picture(judged: Judged) -> bytes:
    manifest = judged.bundle.manifest
    note = "   ".join(f"{title} {manifest.errors[name]:.4f}" for name, title in NOTED_ERRORS)
    return side_by_side(*judged.judgement.pictures, title=_title(judged), note=note)


def _title(judged: Judged) -> str:
    return f"{judged.bundle.manifest.name}, {judged.bundle.manifest.model}"
