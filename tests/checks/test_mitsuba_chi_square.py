"""A second opinion on samplers: Mitsuba's own chi-square test of the draws and densities of the table's subjects."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.checks.compiled import densities, draws
from jaxbrdf.core.directions import spherical
from jaxbrdf.types import Query
from tests.checks.subjects import SUBJECTS

WO = spherical(jnp.array(0.7), jnp.array(0.4))
NAMES = ("GGX isotropic, Schlick", "Oren-Nayar", "draws: visible proxy")


def chi_square_test(mi: ModuleType, name: str, *, scale: float = 1.0) -> Any:
    """Mitsuba's test of a subject's sampler against `scale` times its density, for the viewer `WO`."""
    _, brdf, params, _ = SUBJECTS[name].make().material

    def sample(u: Any) -> tuple[Any, Any]:
        numbers = jnp.asarray(np.array(u).T, jnp.float32)
        wi = draws(brdf, params, jnp.broadcast_to(WO, numbers.shape), numbers).wi
        # what is lost below the horizon, the density does not tell
        return mi.Vector3f(wi.T), mi.Float((wi[:, 2] > 0).astype(np.float32))

    def pdf(w: Any) -> Any:
        wi = jnp.asarray(np.array(w).T, jnp.float32)
        return mi.Float(scale * densities(brdf, params, Query(wi, jnp.broadcast_to(WO, wi.shape))))

    # imported under the variant that it is to use; an even number of rows puts the horizon between two of them
    chi2 = importlib.import_module("mitsuba.chi2")
    domain = chi2.SphericalDomain()
    return chi2.ChiSquareTest(domain, sample, pdf, sample_dim=3, sample_count=200_000, res=50, ires=16)


@pytest.mark.parametrize("name", NAMES)
def test_mitsuba_accepts_the_sampler(name: str, mitsuba_arrays: ModuleType):
    test = chi_square_test(mitsuba_arrays, name)
    assert test.run(significance_level=0.01, test_count=len(NAMES), quiet=True), test.messages


def test_mitsuba_rejects_a_density_off_by_three_percent(mitsuba_arrays: ModuleType):
    assert not chi_square_test(mitsuba_arrays, NAMES[0], scale=0.97).run(quiet=True)
