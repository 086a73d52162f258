"""The suite fails what is wrong: each check is given a material with the fault that it is there for."""

from __future__ import annotations

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.checks.suite import CHECKS, Subject, Verdict, run_checks
from jaxbrdf.types import Brdf, Material, Query, Sample

GREY = LambertParams(jnp.full(3, 0.5))


def subject(brdf: Brdf) -> Subject:
    return Subject(Material("grey", brdf, GREY, True), reciprocal=True, conserving=True)


@cache
def sound() -> dict[str, Verdict]:
    return {verdict.check: verdict for verdict in run_checks(jax.random.key(0), subject(LAMBERT))}


def sample_off(scale: float):
    def sample(params: LambertParams, query: Query, u: jax.Array) -> Sample:
        drawn = LAMBERT.sample(params, query, u)
        return drawn._replace(pdf=scale * drawn.pdf, weight=drawn.weight / scale)

    return sample


def lost_light(params: LambertParams, query: Query) -> jax.Array:
    return jnp.where(query.wi[..., :1] > 0.9, jnp.nan, LAMBERT.eval(params, query))


def rough(params: LambertParams, query: Query) -> jax.Array:
    """1 - cos of a small angle by subtraction, which leaves float32 few digits."""
    return LAMBERT.eval(params, query) * (1.0 + 1e-6 / (1.0 + 1e-6 - query.wi[..., 2:]))


def kinked(params: LambertParams, query: Query) -> jax.Array:
    """The slope is not the value's."""
    return LAMBERT.eval(params, query) * jax.lax.stop_gradient(1.0 + query.wi[..., :1])


def lopsided(params: LambertParams, query: Query) -> jax.Array:
    return LAMBERT.eval(params, query) * (1.0 + 0.1 * query.wi[..., 2:])


def gaining(params: LambertParams, query: Query) -> jax.Array:
    return 2.1 * LAMBERT.eval(params, query)


FAULTS = {
    "finite": subject(LAMBERT._replace(eval=lost_light)),
    "precision": subject(LAMBERT._replace(eval=rough)),
    "derivative": subject(LAMBERT._replace(eval=kinked)),
    "reciprocity": subject(LAMBERT._replace(eval=lopsided)),
    "energy": subject(Brdf(gaining)),
    "density": subject(LAMBERT._replace(sample=sample_off(1.02), pdf=lambda p, q: 1.02 * LAMBERT.pdf(p, q))),
    "sampler": subject(LAMBERT._replace(pdf=lambda p, q: LAMBERT.pdf(p, q) * (0.8 + 0.3 * q.wi[..., 2]))),
    "weight": subject(LAMBERT._replace(sample=sample_off(1.02))),
}


def test_a_sound_material_passes_every_check():
    assert {name: verdict.passed for name, verdict in sound().items()} == dict.fromkeys(CHECKS, True)


@pytest.mark.parametrize("check", CHECKS)
def test_a_check_sees_its_fault(check: str):
    verdicts = CHECKS[check](jax.random.key(1), FAULTS[check])
    assert [verdict.passed for verdict in verdicts if verdict.check == check] == [False], verdicts


def test_what_is_not_promised_is_measured():
    kept = Material("lopsided", Brdf(lopsided), GREY, True)
    verdicts = {verdict.check: verdict for verdict in run_checks(jax.random.key(0), Subject(kept))}
    assert verdicts["reciprocity"].passed is None
    assert verdicts["energy"].passed is None
    assert 0.01 < verdicts["reciprocity"].value < 0.1
    assert np.isnan(verdicts["reciprocity"].bound)
    assert not {"density", "sampler", "weight"} & set(verdicts)
