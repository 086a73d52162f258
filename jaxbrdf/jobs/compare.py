"""A bundle against the file that it was fitted to, and against a published network of the same material."""

from __future__ import annotations

from typing import Any

from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.planar_judge import planar_report
from jaxbrdf.jobs.source import is_texture_folder, open_bundle, open_source
from jaxbrdf.jobs.surface import open_surface
from jaxbrdf.jobs.surface_judge import materials_of, reference_of
from jaxbrdf.metrics.brdf_space import BrdfErrors

COMPARED = ("mae", "smape", "rmse", "log_rmse")


def compare(bundle: str, reference: str, *, against: str | None = None) -> dict[str, Any]:
    """Errors of the bundle, of the other network if one is given, and their ratios; of both renderings too.

    A bundle of a surface is judged against the folder of its textures, on the planar scene and beside plain mip maps.

    Raises:
        JaxbrdfError: if one of the files cannot be used.
    """
    if is_texture_folder(reference):
        return _compare_surface(bundle, reference, against)
    fitted = bundles.material(open_bundle(bundle))
    truth = symmetrised(open_source(reference).material)
    materials = {"bundle": fitted} | ({"against": open_source(against).material} if against else {})
    draws = judge.draw(truth)
    errors, pictures = judge.brdf_errors(materials, draws), judge.pictures(materials, draws.lighting)
    report: dict[str, Any] = {
        name: judge.plain_errors(errors[name]) | judge.picture_errors(pictures[name]) for name in errors
    }
    report["pairs"] = errors["bundle"].pairs
    if against:
        report["ratio"] = ratios(errors["bundle"], errors["against"])
    return report


def _compare_surface(name: str, folder: str, against: str | None) -> dict[str, Any]:
    if against:
        raise JaxbrdfError(f"{against}: one reflectance cannot be judged by a folder of textures")
    bundle = open_bundle(name, surfaces=True)
    if not bundle.manifest.is_spatial:
        raise JaxbrdfError(f"{name}: is the same everywhere; a folder of textures is for bundles of surfaces")
    latents = bundle.manifest.config.latents
    surface = open_surface(folder, size=max(latents.height, latents.width))
    return {"planar": planar_report(materials_of(bundle, surface), reference_of(surface))}


def ratios(ours: BrdfErrors, theirs: BrdfErrors) -> dict[str, float]:
    """Our errors over theirs, by name."""
    return {name: float(getattr(ours, name).value / getattr(theirs, name).value) for name in COMPARED}
