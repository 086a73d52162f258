"""From a trained model to the bundle that is written: what conserves energy, what draws light, and what both give."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxbrdf.brdf.albedo_table import tabulate_albedo
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.fit.energy import fit_energy_scale
from jaxbrdf.fit.proxy import ProxyFit, fit_proxy
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.fit_config import FitConfig
from jaxbrdf.jobs.fitting import Judged, judged_as_stored
from jaxbrdf.jobs.progress import Reporter

ISOTROPIC, ANISOTROPIC = ProxyFit(), ProxyFit(elevations=16, azimuths=8, points=1024)
"""Of the sampler; an anisotropic material has four times the viewers, and half the points for each."""


class Finished(NamedTuple):
    """A judged bundle with its parts, and what a report says of them."""

    judged: Judged
    findings: dict[str, Any]


def finished(bundle: Bundle, config: FitConfig, draws: judge.Draws, reporter: Reporter) -> Finished:
    """The bundle as it is stored, with the parts that are asked for, its errors and its albedo.

    Raises:
        FitError: if the precision does not hold it, or an error is not finite.
    """
    reporter.say("judging")
    judged, findings = judged_as_stored(bundle, config.precision, draws), {}
    if config.conserve_energy:
        scaled = with_energy_scale(judged.bundle, reporter)
        findings["without_energy_scale"] = judged.bundle.manifest.errors if scaled.parts.scale is not None else None
        judged = judged_as_stored(scaled, config.precision, draws)
    whole = with_albedo(judged.bundle)
    findings["largest_albedo"] = (
        np.asarray(whole.parts.albedo.values).max((0, 1)).tolist() if whole.parts.albedo else None
    )
    whole = with_sampler(whole, reporter) if config.sampler else whole
    return Finished(judged._replace(bundle=whole), findings)


def with_energy_scale(bundle: Bundle, reporter: Reporter) -> Bundle:
    """The bundle whose albedo is at most one; itself where it is."""
    reporter.say("looking for what the fit reflects beyond the light that it gets")
    clock, made = time.perf_counter(), bundles.material(bundle)
    scale = fit_energy_scale(made.brdf.eval, made.params, isotropic=made.isotropic)
    return _with_cost(bundle._replace(parts=bundle.parts._replace(scale=scale)), "energy_seconds", clock)


def with_albedo(bundle: Bundle) -> Bundle:
    """The bundle with its directional albedo, measured as it is."""
    made = bundles.material(bundle)
    table = tabulate_albedo(made.brdf.eval, made.params, isotropic=made.isotropic)
    return bundle._replace(parts=bundle.parts._replace(albedo=jax.tree.map(np.asarray, table)))


def with_sampler(bundle: Bundle, reporter: Reporter) -> Bundle:
    """The bundle with a sampler fitted to the light that it reflects."""
    reporter.say("fitting the sampler")
    clock, made = time.perf_counter(), bundles.material(bundle)
    config = ISOTROPIC if made.isotropic else ANISOTROPIC
    sampler = jax.tree.map(np.asarray, fit_proxy(made.brdf.eval, made.params, config=config))
    return _with_cost(bundle._replace(parts=bundle.parts._replace(sampler=sampler)), "sampler_seconds", clock)


def largest_albedo(bundle: Bundle) -> list[float] | None:
    """Of R, G and B over all viewers; None where it was not measured."""
    table = bundle.parts.albedo
    return None if table is None else np.asarray(table.values).max((0, 1)).tolist()


def _with_cost(bundle: Bundle, name: str, clock: float) -> Bundle:
    """The bundle with the seconds since `clock` among its costs."""
    manifest = bundle.manifest
    cost = manifest.cost | {name: time.perf_counter() - clock}
    return bundle._replace(manifest=manifest._replace(cost=cost))
