"""A bundle against the file that it was fitted to, and against a published network of the same material."""

from __future__ import annotations

from typing import Any

from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.source import open_bundle, open_source
from jaxbrdf.metrics.brdf_space import BrdfErrors

COMPARED = ("mae", "smape", "rmse", "log_rmse")


def compare(bundle: str, reference: str, *, against: str | None = None) -> dict[str, Any]:
    """Errors of the bundle, of the other network if one is given, and their ratios; of both renderings too.

    Raises:
        JaxbrdfError: if one of the files cannot be used.
    """
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


def ratios(ours: BrdfErrors, theirs: BrdfErrors) -> dict[str, float]:
    """Our errors over theirs, by name."""
    return {name: float(getattr(ours, name).value / getattr(theirs, name).value) for name in COMPARED}
