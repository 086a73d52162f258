"""Every check that a material admits, a user's own bundle among them."""

from __future__ import annotations

import contextlib
from typing import Any

import jax
import numpy as np

from jaxbrdf.checks.parity import RELATIVE, demanding_queries, jax_values, opencl_parity
from jaxbrdf.checks.suite import Subject, Verdict, run_checks
from jaxbrdf.errors import DataError, OpenCLError
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.source import Source, is_bundle_content, open_source
from jaxbrdf.models.table import is_reciprocal
from jaxbrdf.opencl.platform import choose

SEED = 20_260_102


def stability(name: str, reporter: Reporter) -> dict[str, Any]:
    """The verdicts on a bundle, a measured file or a built-in material, and how many passed and failed.

    A bundle that is not sound fails its first check.

    Raises:
        DataError: if there is nothing to be checked.
    """
    try:
        source = open_source(name)
    except DataError as error:
        if not is_bundle_content(name):
            raise
        return _result(name, [Verdict("file", False, 1.0, 0.0, error.fault)])
    reporter.say(f"checking {source.material.name}")
    verdicts = run_checks(jax.random.key(SEED), _subject(source))
    if source.bundle is not None:
        verdicts = [Verdict("file", True, 0.0, 0.0, "sound"), *verdicts, *_device(source.bundle)]
    return _result(source.material.name, verdicts)


def _subject(source: Source) -> Subject:
    """What a bundle's model promises; measured values and sums of lobes promise nothing."""
    reciprocal = source.bundle is not None and is_reciprocal(source.bundle.manifest.model)
    return Subject(source.material, reciprocal=reciprocal)


def _device(bundle: Bundle) -> list[Verdict]:
    """The bundle's kernel against JAX in float64, where there is a device."""
    query = demanding_queries(jax.random.key(SEED), count=4096)
    with contextlib.suppress(OpenCLError):
        worst = opencl_parity(bundle, choose(), query, jax_values(bundle, query))
        return [
            Verdict("opencl", worst.violation <= 1.0, worst.violation * RELATIVE, RELATIVE, "kernel against float64")
        ]
    return []


def _result(name: str, verdicts: list[Verdict]) -> dict[str, Any]:
    rows = [verdict._asdict() | {"bound": None if np.isnan(verdict.bound) else verdict.bound} for verdict in verdicts]
    passed, failed = (sum(verdict.passed is wanted for verdict in verdicts) for wanted in (True, False))
    return {"name": name, "checks": rows, "passed": passed, "failed": failed}
