"""The table of reflectances and samplers against all checks, and nothing that is exported left out of it."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import jax
import pytest

import jaxbrdf.brdf
import jaxbrdf.sampling
from jaxbrdf.brdf.builtin import MATERIALS
from jaxbrdf.checks.extremes import extremes
from jaxbrdf.checks.hard import HARD_QUERIES
from jaxbrdf.checks.search import search_faults
from jaxbrdf.checks.suite import Subject, run_checks
from jaxbrdf.models.table import BUNDLED
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.types import Brdf
from tests.checks.subjects import SUBJECTS

ELSEWHERE = {
    "jaxbrdf.brdf.composite.composite": "built-in glazed-ceramic",
    "jaxbrdf.brdf.cosine_sampler.cosine_sampled": "its makers' own tests",
    "jaxbrdf.brdf.domain.within_ranges": "every BRDF is one",
    "jaxbrdf.brdf.microfacet.microfacet": "MICROFACET and SEPARABLE_MICROFACET",
    "jaxbrdf.brdf.rough_interface.rough_interface": "ROUGH_INTERFACE and SEPARABLE_ROUGH_INTERFACE",
    "jaxbrdf.brdf.proposed.sampled_by": "every proposal's row",
    "jaxbrdf.brdf.merl.brdf": "needs a file: tests/brdf/test_merl.py",
    "jaxbrdf.brdf.rgl.brdf": "needs a file: tests/brdf/test_rgl.py",
    "jaxbrdf.brdf.utia.BRDF": "needs a file: tests/brdf/test_utia.py",
    "jaxbrdf.brdf.published_nbrdf.BRDF": "needs a file: tests/brdf/test_published_nbrdf.py",
    "jaxbrdf.sampling.view_proxy.of_view": "VIEW_PROXY and VISIBLE_VIEW_PROXY",
}
"""What has no row of its own, and which row or test has it."""


@pytest.mark.parametrize("name", SUBJECTS)
def test_every_check(name: str):
    subject = SUBJECTS[name].make()
    assert bool(SUBJECTS[name].reason) is not (subject.loss <= 1e-4), "a larger loss of float32 needs its reason"
    verdicts = run_checks(jax.random.key(0), subject)
    assert not [verdict for verdict in verdicts if verdict.passed is False]
    assert not random_faults(subject)
    assert {"finite", "precision", "derivative", "reciprocity", "energy"} <= {verdict.check for verdict in verdicts}


def random_faults(subject: Subject) -> int:
    """Of some 20 000 values and gradients, in rounds of the size that `run_checks` has compiled: a million of all."""
    _, brdf, params, _ = subject.material
    leaves = jax.tree.leaves(extremes(params, hard=subject.hard))
    if not leaves:
        return 0
    size = {"variants": len(leaves[0]), "queries": len(HARD_QUERIES)}
    return search_faults(jax.random.key(1), brdf, params, count=32 * size["variants"] * size["queries"], **size)


def modules_of(package: ModuleType) -> Iterator[ModuleType]:
    for found in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        yield importlib.import_module(found.name)


def exported(package: ModuleType, kind: type) -> Iterator[tuple[str, Any]]:
    """Public records of this kind, and functions that make one, with their full names."""
    for module in modules_of(package):
        for name, value in vars(module).items():
            makes = callable(value) and getattr(value, "__annotations__", {}).get("return") == kind.__name__
            own = getattr(value, "__module__", None) == module.__name__ if makes else name.isupper()
            if not name.startswith("_") and own and (makes or isinstance(value, kind)):
                yield f"{module.__name__}.{name}", value


@pytest.mark.parametrize(("package", "kind"), [(jaxbrdf.brdf, Brdf), (jaxbrdf.sampling, Proposal)])
def test_everything_exported_has_a_row(package: ModuleType, kind: type):
    covered = [row.covers for row in SUBJECTS.values()]
    found = dict(exported(package, kind))
    assert len(found) > 5
    assert not [name for name, value in found.items() if value not in covered and name not in ELSEWHERE]


def test_every_model_and_built_in_material_has_a_row():
    assert {*BUNDLED, *MATERIALS} <= {row.covers for row in SUBJECTS.values() if isinstance(row.covers, str)}


def test_every_exception_is_still_there():
    packages = ((jaxbrdf.brdf, Brdf), (jaxbrdf.sampling, Proposal))
    assert set(ELSEWHERE) <= {name for package, kind in packages for name, _ in exported(package, kind)}
