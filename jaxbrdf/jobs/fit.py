"""Fit a material: draw, train, judge, export, and lay a picture beside the reference."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from functools import partial
from importlib.metadata import version
from typing import Any, NamedTuple

import jax

from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import FitError, JaxbrdfError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.manifest import Manifest, Provenance
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.fit_config import FitConfig, FitPaths, model_config, output_paths, prepare_output, preset_of
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.source import Source, open_source
from jaxbrdf.jobs.training import Task, Trained, train
from jaxbrdf.models.table import MODELS
from jaxbrdf.report.pictures import side_by_side

NOTED_ERRORS = (("image_flip", "FLIP"), ("mae", "MAE"), ("smape", "SMAPE"), ("rmse", "RMSE"))


class FitResult(NamedTuple):
    """What a fit leaves behind.

    Attributes:
        paths: of its files.
        report: as written in the report's file.
    """

    paths: FitPaths
    report: dict[str, Any]


def fit(config: FitConfig, reporter: Reporter) -> FitResult:
    """Fits `config.source` and writes bundle, report and picture; the checkpoint goes when they are there.

    Raises:
        JaxbrdfError: if the input, the output or the request cannot be used, or the training diverges.
    """
    preset = preset_of(config)
    source = open_source(config.source)
    if source.bundle is not None:
        raise JaxbrdfError(f"{config.source}: is a bundle already; a fit wants a measured file or a built-in material")
    paths = output_paths(config.output)
    prepare_output(paths)
    truth = symmetrised(source.material)
    sizes = model_config(config.model, isotropic=truth.isotropic, hidden=None if config.paper_sizes else preset.hidden)
    compiled = jax.jit(partial(truth.brdf.eval, truth.params))
    record = {"input": source.sha256 or source.material.name, "model": repr(sizes), "preset": config.preset}
    task = Task(
        model=MODELS[config.model].build(sizes),
        truth=compiled,
        preset=preset,
        seed=config.seed,
        checkpoint=paths.checkpoint,
        record={**record, "seed": config.seed, "devices": len(jax.devices())},
    )
    trained = train(task, config.budget_seconds, config.resume, reporter)
    bundle = _as_stored(_bundle(config, source, sizes, trained), config, paths)
    return _judge_and_write(config, source, compiled, bundle, paths, reporter)


def _bundle(config: FitConfig, source: Source, sizes: Any, trained: Trained) -> Bundle:
    provenance = Provenance(
        input=source.path.name if source.path else source.material.name,
        sha256=source.sha256,
        version=version("jaxbrdf"),
        seed=config.seed,
        preset=config.preset,
        steps=trained.steps,
    )
    manifest = Manifest(source.material.name, config.model, sizes, provenance, errors={}, cost=trained.cost)
    return Bundle(manifest, trained.params)


def _as_stored(bundle: Bundle, config: FitConfig, paths: FitPaths) -> Bundle:
    """The bundle as a reader of its file gets it: rounded to the precision, which the errors are to include."""
    try:
        return bundles.from_bytes(bundles.to_bytes(bundle, precision=config.precision), paths.bundle)
    except ValueError as error:
        raise FitError(f"{paths.bundle}: {error}; the checkpoint is kept in {paths.checkpoint}") from None


def _finite(errors: dict[str, float], paths: FitPaths) -> dict[str, float]:
    for name, value in errors.items():
        if not math.isfinite(value):
            raise FitError(f"{paths.bundle}: the fit's {name} is {value}; the checkpoint is kept in {paths.checkpoint}")
    return errors


def _judge_and_write(
    config: FitConfig, source: Source, truth: Any, bundle: Bundle, paths: FitPaths, reporter: Reporter
) -> FitResult:
    reporter.say("judging")
    fitted = bundles.material(bundle)
    errors = judge.brdf_errors({"fit": fitted}, truth)["fit"]
    pictures = judge.render_pair(fitted, symmetrised(source.material))
    plain = _finite(judge.plain_errors(errors) | judge.picture_errors(pictures), paths)
    cost = bundle.manifest.cost | judge.evaluation_cost(bundle)
    bundle = bundle._replace(manifest=bundle.manifest._replace(errors=plain, cost=cost))
    report = {
        "config": asdict(config),
        "errors": plain,
        "cost": cost,
        "opencl_device": judge.opencl_device(),
        "source": judge.describe_truth(source),
    }
    bundles.save(paths.bundle, bundle, precision=config.precision)
    write_atomically(paths.report, json.dumps(report, indent=1).encode())
    note = "   ".join(f"{title} {plain[name]:.4f}" for name, title in NOTED_ERRORS)
    title = f"{source.material.name}, {config.model}"
    write_atomically(paths.picture, side_by_side(*pictures, title=title, note=note))
    paths.checkpoint.unlink(missing_ok=True)
    return FitResult(paths, report)
