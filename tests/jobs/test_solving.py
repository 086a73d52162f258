"""Analytic models that are solved for: parameters found again, what is told of them, and a fit from end to end."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.directions import spherical
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.fit import fit
from jaxbrdf.jobs.fit_config import FitConfig
from jaxbrdf.jobs.solving import FOLLOWED, Problem, solve_for, uncertainty
from jaxbrdf.models.abc import AbcConfig
from jaxbrdf.models.ggx import BareGgxConfig, GgxConfig, GgxLobe, GgxLobesParams
from jaxbrdf.models.table import brdf_of
from jaxbrdf.types import Query
from tests.jobs.tiny import Listener, hasten_judge

TRUE = GgxLobesParams(None, (GgxLobe(jnp.array([0.9, 0.6, 0.3]), Isotropic(jnp.array(0.15))),))
NAMES = ["lobes.0.f0.0", "lobes.0.f0.1", "lobes.0.f0.2", "lobes.0.roughness.alpha"]


def problem() -> Problem:
    config = BareGgxConfig()
    return Problem("ggx-only", config, jax.jit(partial(brdf_of("ggx-only", config).eval, TRUE)), 0)


def test_parameters_are_found_again():
    found = solve_for(problem(), Listener())
    for value, wanted in zip(jax.tree.leaves(found.params), jax.tree.leaves(TRUE), strict=True):
        np.testing.assert_allclose(value, wanted, rtol=5e-3)
    assert min(found.findings["start_costs"]) < 1e-5


def test_a_lobe_that_nobody_needs_is_no_spike():
    """Which the mean over cosine-distributed directions would not see: alpha 1e-4 is 1e7 times as bright."""
    config = GgxConfig()
    matte = GgxLobesParams(jnp.full(3, 0.5), (GgxLobe(jnp.full(3, 0.01), Isotropic(jnp.array(0.5))),))
    truth = jax.jit(partial(brdf_of("ggx", config).eval, matte))
    found = solve_for(Problem("ggx", config, truth, 0), Listener())
    theta = jnp.linspace(0.0, 1.4, 15)
    mirrored = Query(spherical(theta, jnp.zeros_like(theta)), spherical(theta, jnp.full_like(theta, jnp.pi)))
    np.testing.assert_allclose(brdf_of("ggx", config).eval(found.params, mirrored), truth(mirrored), rtol=0.1)


def test_uncertainty_is_least_where_the_data_say_most():
    noise = jnp.exp(0.1 * jax.random.normal(jax.random.key(3), (4096, 3)))
    exact = problem()
    noisy = Problem(exact.model, exact.config, lambda query: exact.truth(query) * noise, 0)
    told = uncertainty(noisy, TRUE)
    f0, alpha = (told["parameters"][name] for name in ("lobes.0.f0", "lobes.0.roughness.alpha"))
    np.testing.assert_allclose(f0["value"], TRUE.lobes[0].f0)
    # 4,096 residuals of 0.1 a channel: of ln f0 about 0.1 / 64 if the roughness were known
    assert 1e-3 < f0["standard_error"][0] / 0.9 < 1e-2
    assert alpha["standard_error"] < 2e-3
    assert told["correlation"]["names"] == NAMES
    matrix = np.array(told["correlation"]["matrix"])
    np.testing.assert_allclose(np.diag(matrix), 1.0)
    np.testing.assert_array_equal(matrix, matrix.T)
    # most pairs see the lobe's foot, which is as bright where it is wider and reflects less
    assert (matrix[3, :3] < -0.5).all()


def test_a_model_without_axes_says_so():
    def truth(_: Query) -> jax.Array:
        raise InterruptedError

    listener = Listener()
    with pytest.raises(InterruptedError):
        solve_for(Problem("abc", AbcConfig(isotropic=False), truth, 0), listener)
    assert "abc has no axes" in listener.lines[-1]


def test_a_fit_from_end_to_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    hasten_judge(partial(monkeypatch.setattr, judge))
    result = fit(FitConfig("gold", str(tmp_path), model="ggx-only", sampler=False), Listener())
    report = json.loads(result.paths.report.read_text(), parse_constant=pytest.fail)
    assert report == result.report
    assert report["errors"]["smape"] < 0.1
    assert report["correlation"]["names"] == NAMES
    assert len(report["start_costs"]) == FOLLOWED
    bundle = bundles.load(result.paths.bundle)
    assert bundle.manifest.provenance.preset == "least-squares"
    np.testing.assert_allclose(report["parameters"]["lobes.0.f0"]["value"], bundle.params.lobes[0].f0)
    assert not result.paths.checkpoint.exists()
