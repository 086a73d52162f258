"""Fit a texture set: train over all places and scales, judge on the planar scene, export, and show all scales."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import jax
import numpy as np

from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import FitError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.fit import FitResult
from jaxbrdf.jobs.fit_config import prepare_output, surface_paths
from jaxbrdf.jobs.planar_judge import PlanarReference, planar_report
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.surface import Surface, open_surface
from jaxbrdf.jobs.surface_config import SurfaceFitConfig
from jaxbrdf.jobs.surface_judge import materials_of, reference_of
from jaxbrdf.jobs.surface_training import surface_bundle, surface_task
from jaxbrdf.jobs.training import train
from jaxbrdf.render.planar_scene import scene_footprints, scene_picture
from jaxbrdf.report.scale_strip import scale_strip

SHOWN = (1, 1)
"""Camera and light of the picture beside a fit: at a slant, with the light in its mirror direction."""

NOTED = (("flip", "FLIP"), ("ssim", "SSIM"))


def fit_surface(config: SurfaceFitConfig, reporter: Reporter) -> FitResult:
    """Fits the textures in `config.source` and writes bundle, report and picture.

    Raises:
        JaxbrdfError: if the input, the output or the request cannot be used, or the training diverges.
    """
    preset, paths = config.recipe, surface_paths(config.output)
    surface = open_surface(config.source, size=config.size, normals=config.normals, resample=config.resample)
    sizes = config.sizes(surface.layout)
    prepare_output(paths)
    for line in surface.told:
        reporter.say(line)
    task = surface_task(config.model, sizes, surface, preset, seed=config.seed, checkpoint=paths.checkpoint)
    trained = train(task, config.budget_seconds, config.resume, reporter)
    bundle = surface_bundle(config.model, sizes, surface, task, trained)
    reporter.say("judging on the planar scene")
    try:
        stored = bundles.from_bytes(bundles.to_bytes(bundle, precision=config.precision), surface.name)
    except ValueError as error:
        raise FitError(f"{paths.bundle}: {error}; the checkpoint is kept in {paths.checkpoint}") from None
    reference = reference_of(surface)
    report = planar_report(materials_of(stored, surface), reference)
    errors = errors_in(report)
    judged = stored._replace(manifest=stored.manifest._replace(errors=errors))
    bundles.save(paths.bundle, judged, precision=config.precision)
    whole = {
        "config": asdict(config),
        "errors": errors,
        "cost": trained.cost,
        "planar": report,
        "source": _told(surface),
    }
    write_atomically(paths.report, json.dumps(whole, indent=1).encode())
    write_atomically(paths.picture, _picture(judged, surface, reference))
    paths.checkpoint.unlink(missing_ok=True)
    return FitResult(paths, whole)


def errors_in(report: dict[str, Any]) -> dict[str, float]:
    """The fit's mean errors of a planar report, by the names that bundles have for them."""
    fit = report["materials"]["fit"]
    errors = {f"planar_{name}": float(fit[name][0]) for name in ("flip", "ssim", "mae", "rmse")}
    return errors | {name: fit[name] for name in ("mae_hdr", "rmse_hdr")}


def _told(surface: Surface) -> dict[str, Any]:
    return {
        "name": surface.name,
        "rows": surface.layout.height,
        "columns": surface.layout.width,
        "sha256": surface.sha256,
        "told": list(surface.told),
    }


def _picture(bundle: Bundle, surface: Surface, reference: PlanarReference) -> bytes:
    """Reference, fit and mip maps over the scales, at a slant."""
    scene, errors = reference.scene, bundle.manifest.errors
    places = [(scale, *SHOWN) for scale in range(scene.scales)]
    rows = {"reference": np.stack([reference.halves[(slice(None), *at)].mean(axis=0) for at in places])}
    for name, material in materials_of(bundle, surface).items():
        # nothing is drawn: both take footprints
        rows[name] = np.stack([scene_picture(jax.random.key(0), material, scene, at) for at in places])
    note = "   ".join(f"{title} {errors[f'planar_{name}']:.4f}" for name, title in NOTED)
    texels = scene_footprints(scene) * scene.texels
    return scale_strip(rows, texels, title=f"{bundle.manifest.name}, {bundle.manifest.model}   {note}")
