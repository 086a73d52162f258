"""Every check that a material admits, a user's own bundle among them."""

from __future__ import annotations

import contextlib
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pyopencl as cl

from jaxbrdf.checks.chi_square import chi_square_of_draws, expected_mass, significance_of_each
from jaxbrdf.checks.parity import (
    ABSOLUTE,
    RELATIVE,
    demanding_queries,
    jax_densities,
    jax_values,
    opencl_parity,
    placed,
)
from jaxbrdf.checks.partition import partition_around
from jaxbrdf.checks.placed import at_place
from jaxbrdf.checks.precision import coordinate_slack
from jaxbrdf.checks.suite import SIGNIFICANCE, STEPS, VIEWERS, Subject, Verdict, run_checks, viewer
from jaxbrdf.errors import DataError, OpenCLError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.progress import Reporter, Tell
from jaxbrdf.jobs.source import Source, is_bundle_content, open_source
from jaxbrdf.models.table import LEARNED, is_reciprocal
from jaxbrdf.opencl.platform import choose, context_of
from jaxbrdf.opencl.sampler import Sampler
from jaxbrdf.texture.pyramid import Layout
from jaxbrdf.types import Query

SEED = 20_260_102

PLACES = {"fine": ((0.37, 0.61), 0.0), "middle": ((0.37, 0.61), 1.0 / 16.0), "far": ((0.37, 0.61), 2.0)}
"""Of a surface: uv, and the side of a footprint in uv, from a point to all of the texture."""


def stability(name: str, reporter: Reporter) -> dict[str, Any]:
    """The verdicts on a bundle, a measured file or a built-in material, and how many passed and failed.

    A bundle that is not sound fails its first check.

    Raises:
        DataError: if there is nothing to be checked.
    """
    try:
        source = open_source(name, surfaces=True)
    except DataError as error:
        if not is_bundle_content(name):
            raise
        return _result(name, [Verdict("file", False, 1.0, 0.0, error.fault)])
    subjects = _subjects(source)
    with reporter.steps(f"checking {source.material.name}", len(subjects) * len(STEPS) + 1) as tell:
        verdicts: list[Verdict] = []
        for index, (place, subject) in enumerate(subjects.items()):
            told = partial(_tell_from, tell, index * len(STEPS))
            found = run_checks(jax.random.key(SEED), subject, tell=told)
            verdicts += [verdict._replace(check=f"{place}{verdict.check}") for verdict in found]
        if source.bundle is not None:
            tell(len(subjects) * len(STEPS), "opencl")
            verdicts = [Verdict("file", True, 0.0, 0.0, "sound"), *verdicts, *_device(source.bundle)]
        tell(len(subjects) * len(STEPS) + 1, "")
    return _result(source.material.name, verdicts)


def _tell_from(tell: Tell, first: int, done: int, note: str) -> None:
    tell(first + done, note)


def _subjects(source: Source) -> dict[str, Subject]:
    """What is checked, by what goes before the checks' names: of a surface its reflectance at `PLACES`."""
    subject = _subject(source)
    if source.bundle is None or not source.bundle.manifest.is_spatial:
        return {"": subject}
    return {f"{name}: ": at_place(subject, *place) for name, place in PLACES.items()}


def _subject(source: Source) -> Subject:
    """What a bundle's model promises; measured values and sums of lobes promise nothing."""
    if source.bundle is None:
        return Subject(source.material)
    manifest, params, parts = source.bundle
    slack = None
    if manifest.model in LEARNED:
        slack = partial(coordinate_slack, LEARNED[manifest.model].build(manifest.config), params)
    reciprocal, conserving = is_reciprocal(manifest.model), parts.scale is not None
    return Subject(source.material, reciprocal=reciprocal, conserving=conserving, slack=slack)


def _device(bundle: Bundle) -> list[Verdict]:
    """The bundle's kernel against JAX in float64, where there is a device."""
    query = demanding_queries(jax.random.key(SEED), count=4096)
    if bundle.manifest.is_spatial:
        query = _under_probes(query, bundle.manifest.config.latents.layout)
    verdicts = []
    with contextlib.suppress(OpenCLError):
        device = choose()
        worst = opencl_parity(bundle, device, query, jax_values(bundle, query)).violation * RELATIVE
        verdicts.append(Verdict("opencl", worst <= RELATIVE, worst, RELATIVE, "kernel against float64"))
        if bundle.parts.sampler is not None:
            verdicts += _device_sampler(bundle, device, query)
    return verdicts


def _under_probes(query: Query, layout: Layout) -> Query:
    """The directions at random places, under footprints of 4 texels by 1: float32 tells the ends of longer ones less
    well than 1e-4 of f."""
    query = placed(jax.random.key(SEED + 1), query, layout)
    footprint = jnp.array([[4.0 / layout.width, 0.0], [0.0, 1.0 / layout.height]])
    return query._replace(footprint=jnp.broadcast_to(footprint, (len(query.wi), 2, 2)))


def _device_sampler(bundle: Bundle, device: cl.Device, query: Query) -> list[Verdict]:
    """The sampler's kernels: densities against JAX in float64, and draws against their densities."""
    sampler, made = Sampler.load(bundle, context_of(device)), bundles.material(bundle)
    expected = jax_densities(bundle, query)
    loss = np.abs(sampler.pdf(np.asarray(query.wi), np.asarray(query.wo)) - expected) / (expected + ABSOLUTE)
    worst = float(np.nan_to_num(loss, nan=np.inf).max())
    chances, random = [], np.random.default_rng(SEED)
    for theta in VIEWERS:
        wo = viewer(theta)
        u = random.uniform(size=(2**17, 3)).astype(np.float32)
        drawn = sampler.sample(np.broadcast_to(wo, u.shape), u).wi.astype(np.float64)
        around = partition_around(drawn, wo)
        mass = expected_mass(made.brdf, made.params, wo, partition=around, points=32)
        chances.append(chi_square_of_draws(drawn, mass, partition=around).p_value)
    least = significance_of_each(SIGNIFICANCE, len(chances))
    return [
        Verdict("opencl pdf", worst <= RELATIVE, worst, RELATIVE, "density against float64"),
        Verdict("opencl draws", min(chances) > least, min(chances), least, f"least of {len(chances)} chi-squares"),
    ]


def _result(name: str, verdicts: list[Verdict]) -> dict[str, Any]:
    rows = [verdict._asdict() | {"bound": None if np.isnan(verdict.bound) else verdict.bound} for verdict in verdicts]
    passed, failed = (sum(verdict.passed is wanted for verdict in verdicts) for wanted in (True, False))
    return {"name": name, "checks": rows, "passed": passed, "failed": failed}
