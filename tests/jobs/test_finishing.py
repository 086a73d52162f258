"""A finished bundle: what it reflects is bounded, it draws light, and the report says what that cost."""

from __future__ import annotations

from functools import partial

import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.checks.parity import random_params
from jaxbrdf.checks.rings import albedo_by_rings
from jaxbrdf.core.directions import spherical
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs import finishing, judge
from jaxbrdf.jobs.finishing import finished
from jaxbrdf.jobs.fit_config import FitConfig
from jaxbrdf.jobs.reference import open_reference
from jaxbrdf.models.nbrdf import NbrdfConfig, nbrdf
from tests.export.bundles import bundle_of
from tests.jobs.tiny import Listener, hasten_finishing, hasten_judge


def bright() -> Bundle:
    """A network that reflects twice the light that it gets."""
    params = random_params(5, nbrdf(NbrdfConfig(hidden=(4,))))
    biases = (params.biases[0], np.float32([-0.2, -0.3, -3.0]))
    return bundle_of("nbrdf", NbrdfConfig(hidden=(4,)), params._replace(biases=biases))


@pytest.fixture
def draws(monkeypatch: pytest.MonkeyPatch) -> judge.Draws:
    hasten_judge(partial(monkeypatch.setattr, judge))
    return judge.draw(open_reference("gold").material)


def test_a_bundle_that_conserves_energy_and_draws_light(draws: judge.Draws, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(finishing, "ISOTROPIC", finishing.ProxyFit(elevations=3, points=256, steps=40))
    judged, findings = finished(bright(), FitConfig("gold", "out", conserve_energy=True), draws, Listener())
    made, plain = bundles.material(judged.bundle), bundles.material(bright())
    for theta in (0.0, 0.9, 1.5):
        wo = np.asarray(spherical(jnp.array(theta), jnp.array(0.4)), float)
        assert albedo_by_rings(plain.brdf.eval, plain.params, wo).max() > 1.5
        assert albedo_by_rings(made.brdf.eval, made.params, wo).max() <= 1.0
    assert 0.98 < max(findings["largest_albedo"]) <= 1.0
    assert findings["without_energy_scale"]["mae"] != judged.bundle.manifest.errors["mae"]
    assert {"energy_seconds", "sampler_seconds"} < judged.bundle.manifest.cost.keys()
    assert bundles.from_bytes(bundles.to_bytes(judged.bundle), "x").parts.sampler.nodes.shape == (1, 3, 9)


def test_parts_that_are_not_asked_for_are_not_there(draws: judge.Draws, monkeypatch: pytest.MonkeyPatch):
    hasten_finishing(partial(monkeypatch.setattr, finishing))
    judged, findings = finished(bright(), FitConfig("gold", "out", sampler=False), draws, Listener())
    assert judged.bundle.parts.scale is None
    assert judged.bundle.parts.sampler is None
    assert "without_energy_scale" not in findings
