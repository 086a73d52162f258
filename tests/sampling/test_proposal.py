"""Proposals and mixtures of them: chi-square, chances that are zero or vary, what a BRDF makes of any proposal."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.builtin import MATERIALS
from jaxbrdf.brdf.proposed import propose
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Axes, Isotropic
from jaxbrdf.sampling.defensive import defensive
from jaxbrdf.sampling.mixture import MixtureParams, choose, mixture
from jaxbrdf.sampling.proposal import COSINE, UNIFORM, VISIBLE_NORMALS

ROUGH = Ggx(Axes(jnp.float32(0.4), jnp.float32(0.2)))
ALL = mixture(COSINE, UNIFORM, VISIBLE_NORMALS)
CASES = {
    "cosine": (COSINE, None),
    "uniform": (UNIFORM, None),
    "GGX": (VISIBLE_NORMALS, ROUGH),
    "Beckmann": (VISIBLE_NORMALS, Beckmann(Isotropic(jnp.float32(0.3)))),
    "mixture": (ALL, MixtureParams((None, None, ROUGH), jnp.array([1.0, 0.0, 2.0]))),
    "defensive": (defensive(VISIBLE_NORMALS), ROUGH),
}
SEEDS, VIEWERS = (0, 1, 2), (0.0, 0.9, 1.5)


def test_parts_are_chosen_by_their_chances_and_get_what_is_left():
    """Each part writes down its number and the u[0] it was given."""
    draws = [lambda u, i=i: jnp.stack([jnp.full_like(u[..., 0], i), u[..., 0], u[..., 1]], -1) for i in range(4)]
    u = jax.random.uniform(jax.random.key(0), (100_000, 3))
    chances = np.array([0.0, 3.0, 1.0, 0.0])
    drawn = np.asarray(choose(jnp.asarray(chances, jnp.float32), draws, u), float)
    for part, share in enumerate(chances / chances.sum()):
        inside = drawn[:, 0] == part
        assert inside.mean() == pytest.approx(share, abs=5e-3 * (share > 0))
        if share:
            # stretched to [0, 1) again, without the places of other parts
            np.testing.assert_allclose(np.quantile(drawn[inside, 1], [0.1, 0.5, 0.9]), [0.1, 0.5, 0.9], atol=0.01)
    assert np.all((drawn[:, 1] >= 0) & (drawn[:, 1] < 1))
    np.testing.assert_array_equal(drawn[:, 2], np.asarray(u)[:, 1])


def test_the_largest_number_reaches_the_last_part_with_a_chance():
    draws = [lambda u, i=i: jnp.full_like(u, i) for i in range(11)]
    top = jnp.full((1, 3), np.nextafter(np.float32(1), np.float32(0)))
    chances = jnp.array([0.1] * 10 + [0.0])
    assert float(choose(chances, draws, top)[0, 0]) == 9.0


def test_chances_may_vary_over_the_batch():
    wi, wo = (jnp.broadcast_to(spherical(jnp.array(t), jnp.array(0.2)), (2, 3)) for t in (0.4, 0.6))
    params = MixtureParams((None, None, ROUGH), jnp.array([[1.0, 1.0, 0.0], [0.0, 0.0, 5.0]]))
    want = [0.5 * np.cos(0.4) / np.pi + 0.5 / (2 * np.pi), float(VISIBLE_NORMALS.pdf(ROUGH, wi, wo)[1])]
    np.testing.assert_allclose(ALL.pdf(params, wi, wo), want, rtol=1e-6)
    u = jax.random.uniform(jax.random.key(1), (2, 3))
    drawn = ALL.sample(params, wo, u)
    np.testing.assert_array_equal(drawn[1], VISIBLE_NORMALS.sample(ROUGH, wo, u)[1])


def test_any_proposal_estimates_the_same_albedo():
    material = MATERIALS["gold"]()
    wo = spherical(jnp.array(0.8), jnp.array(0.7))
    own = directional_albedo(jax.random.key(0), material.brdf, material.params, wo, samples=50_000)
    for seed, name in enumerate(CASES):
        other = propose(material, *CASES[name])
        found = directional_albedo(jax.random.key(seed), other.brdf, other.params, wo, samples=50_000)
        error = np.hypot(own.standard_error, found.standard_error)
        assert np.all(np.abs(found.value - own.value) < 4 * error), name


def test_samples_tell_what_eval_and_pdf_tell():
    material = propose(MATERIALS["gold"](), *CASES["mixture"])
    wo = jnp.broadcast_to(spherical(jnp.array(1.2), jnp.array(0.3)), (5000, 3))
    u = jax.random.uniform(jax.random.key(2), (5000, 3))
    mismatch = sampler_mismatch(material.brdf, material.params, wo, u)
    assert float(jnp.max(jnp.stack(mismatch))) < 1e-5


def test_a_mixture_of_nothing_is_refused():
    with pytest.raises(ValueError, match="empty"):
        mixture()
