"""The checks see what is wrong: each is given a BRDF with the fault it is there for."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.checks.chi_square import chi_square, pearson, significance_of_each
from jaxbrdf.checks.finite import find_faults
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.hard import HARD_QUERIES
from jaxbrdf.checks.partition import half_vector, polar
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.sampling.hemisphere import square_to_cosine, square_to_uniform, uniform_density
from jaxbrdf.types import Brdf, Query, Sample

GREY = LambertParams(jnp.full(3, 0.5))
WO = jnp.array([0.6, 0.0, 0.8])


def faulty(**parts) -> Brdf:
    return LAMBERT._replace(**parts)


@pytest.mark.parametrize(
    "partition", [polar(), polar(axis=(0.6, 0.0, 0.8), spread=0.1), half_vector((0.6, 0.0, 0.8), 0.4, 0.2)]
)
def test_partitions_invert_and_measure_the_sphere(partition):
    points = np.random.default_rng(0).uniform(0.01, 0.99, (2000, 2))
    w, area = partition.place(points)
    np.testing.assert_allclose(np.linalg.norm(w, axis=-1), 1.0, atol=1e-12)
    seen = area > 0
    np.testing.assert_allclose(partition.locate(w[seen]), points[seen], atol=1e-7)
    step = 1e-6
    sides = [
        (partition.place(points + step * e)[0] - partition.place(points - step * e)[0]) / (2 * step) for e in np.eye(2)
    ]
    np.testing.assert_allclose(area[seen], np.linalg.norm(np.cross(*sides), axis=-1)[seen], rtol=1e-4)


def test_chi_square_sees_a_wrong_sampler():
    def uniform(params: LambertParams, query: Query, u: jax.Array) -> Sample:
        return LAMBERT.sample(params, query, u)._replace(wi=square_to_uniform(u[..., 1:]))

    assert chi_square(jax.random.key(0), faulty(sample=uniform), GREY, WO).p_value < 1e-10
    assert chi_square(jax.random.key(0), LAMBERT, GREY, WO).p_value > 1e-3


def test_chi_square_sees_a_density_off_by_three_percent():
    # it no longer integrates to one, so draws are missed below the horizon
    slack = faulty(pdf=lambda params, query: 0.97 * LAMBERT.pdf(params, query))
    assert chi_square(jax.random.key(0), slack, GREY, WO).p_value < 1e-6


def test_chi_square_sees_draws_lost_below_the_horizon():
    def drop(params: LambertParams, query: Query, u: jax.Array) -> Sample:
        drawn = LAMBERT.sample(params, query, u)
        down = (u[..., 0] < 0.05)[..., None]
        return drawn._replace(wi=jnp.where(down, -drawn.wi, drawn.wi))

    assert chi_square(jax.random.key(0), faulty(sample=drop), GREY, WO).p_value < 1e-6


def test_a_right_samplers_p_values_are_uniform():
    p = [chi_square(jax.random.key(s), LAMBERT, GREY, WO, samples=20_000, points=4).p_value for s in range(40)]
    assert 0.35 < np.mean(p) < 0.65
    assert min(p) > significance_of_each(0.001, 40)


def test_pearson_pools_what_is_rare():
    rare = pearson(np.array([100, 104, 1, 0, 2]), np.array([100.0, 100.0, 1.0, 1.0, 4.0]))
    assert rare.degrees == 2
    assert rare.statistic == pytest.approx(0.16 + 9 / 6)


def test_significance_corrects_for_many_tests():
    assert 1 - (1 - significance_of_each(0.01, 100)) ** 100 == pytest.approx(0.01)


def test_furnace_sees_gained_energy_with_and_without_a_sampler():
    def brighter(params: LambertParams, query: Query) -> jax.Array:
        return 1.3 * LAMBERT.eval(params, query)

    def sample(params: LambertParams, query: Query, u: jax.Array) -> Sample:
        drawn = LAMBERT.sample(params, query, u)
        return drawn._replace(weight=1.3 * drawn.weight)

    for brdf in (Brdf(brighter), faulty(eval=brighter, sample=sample)):
        albedo = directional_albedo(jax.random.key(1), brdf, LambertParams(jnp.array([0.2, 0.5, 1.0])), WO)
        np.testing.assert_allclose(albedo.value, [0.26, 0.65, 1.3], rtol=1e-4)


def test_reciprocity_sees_a_one_sided_cosine():
    query = Query(*square_to_cosine(jax.random.uniform(jax.random.key(2), (2, 100, 2))))
    tilted = Brdf(lambda params, query: LAMBERT.eval(params, query) * query.wi[..., 2:])
    assert float(jnp.max(asymmetry(tilted, GREY, query))) > 0.3
    assert not np.any(asymmetry(LAMBERT, GREY, query))


def test_sampler_mismatch_sees_weight_and_density():
    u, wo = jax.random.uniform(jax.random.key(3), (50, 3)), jnp.broadcast_to(WO, (50, 3))
    heavy = faulty(pdf=lambda params, query: uniform_density(query.wi), eval=lambda p, q: 2 * LAMBERT.eval(p, q))
    found = sampler_mismatch(heavy, GREY, wo, u)
    np.testing.assert_allclose(found.weight, 0.5, rtol=1e-5)
    assert float(jnp.max(found.pdf)) > 0.3


def test_hard_queries_see_each_kind_of_fault():
    def kinds(evaluate) -> set[str]:
        return {finding.fault for finding in find_faults(Brdf(evaluate), jnp.ones(3))}

    assert "value is not finite" in kinds(lambda p, q: LAMBERT.eval(GREY, q) / jnp.maximum(q.wi[..., 2:], 0))
    assert "value below the horizon is not zero" in kinds(lambda p, q: jnp.abs(q.wi))
    assert "value is negative" in kinds(lambda p, q: LAMBERT.eval(GREY, q) - 0.2)
    arc = lambda p, q: jnp.broadcast_to(jnp.arccos(q.wi[..., 2:]), q.wi.shape)  # noqa: E731
    assert "gradient by a direction is not finite" in kinds(arc)
    assert "gradient by a parameter is not finite" in kinds(lambda p, q: LAMBERT.eval(GREY, q) * jnp.sqrt(p[0] - 1.0))


def test_every_hard_query_has_its_own_name_and_a_reason():
    assert len({q.name for q in HARD_QUERIES}) == len(HARD_QUERIES)
    assert all(q.reason for q in HARD_QUERIES)


@pytest.mark.parametrize("check", [chi_square, sampler_mismatch])
def test_checks_of_samplers_refuse_a_brdf_without(check):
    arguments = (Brdf(LAMBERT.eval), GREY, WO)
    with pytest.raises(ValueError, match="no sample"):
        check(*((jax.random.key(0), *arguments) if check is chi_square else (*arguments, WO)))
