"""Errors in BRDF space against closed forms, plain cosine draws, and the spread of repeated estimates."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.microfacet import MICROFACET, ggx
from jaxbrdf.core.fresnel import Schlick
from jaxbrdf.metrics.brdf_space import compare_at, errors, estimate_errors, pair_terms, true_pairs
from jaxbrdf.metrics.estimate import NO_DRAWS, Estimate, add_draws, mean, root
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Query

KEY = jax.random.key(0)


def flat(value: float):
    return lambda query: jnp.full_like(query.wi, value)


def glossy(alpha: float, f0: float):
    params = ggx(jnp.array(alpha), jnp.array(alpha), Schlick(jnp.full(3, f0)))
    return jax.jit(lambda query: MICROFACET.eval(params, query))


def plain(key: jax.Array, count: int) -> tuple[Query, jax.Array]:
    u = jax.random.uniform(key, (2, count, 2))
    return Query(square_to_cosine(u[0]), square_to_cosine(u[1])), jnp.ones(count)


def within(estimate: Estimate, want: float, sigmas: float = 4.0) -> bool:
    return abs(estimate.value - want) <= sigmas * estimate.standard_error + 1e-6 * abs(want)


def test_constants_have_closed_forms():
    p, f = 0.5, 0.2
    found = estimate_errors(KEY, flat(p), flat(f), draw_weighted, pairs=2**18)
    assert found.pairs == 2**18
    assert within(found.mae, 0.3)
    assert within(found.smape, 2 * 0.3 / 0.701)
    assert within(found.rmse, 0.3)
    cos = (np.arange(100_000) + 0.5) / 100_000
    want = np.sqrt(np.mean(2 * cos * (np.log1p(p * cos) - np.log1p(f * cos)) ** 2))
    assert within(found.log_rmse, want)
    assert 0 < found.mae.standard_error < 2e-3


def test_no_difference_is_no_error():
    found = estimate_errors(KEY, flat(0.3), flat(0.3), draw_weighted, pairs=2**16)
    # the two may be compiled apart, each rounding in an order of its own
    assert all(max(tuple(e)) < 1e-7 for e in found[:4])


@pytest.mark.parametrize("alpha", [0.3, 0.6])
def test_importance_sampling_agrees_with_cosine_draws(alpha: float):
    ours = estimate_errors(KEY, glossy(alpha, 0.5), glossy(1.1 * alpha, 0.45), draw_weighted)
    theirs = estimate_errors(jax.random.key(1), glossy(alpha, 0.5), glossy(1.1 * alpha, 0.45), plain)
    for one, other in zip(ours[:4], theirs[:4], strict=True):
        assert abs(one.value - other.value) < 4 * np.hypot(one.standard_error, other.standard_error)


def test_a_narrow_highlight_is_measured_where_cosine_draws_miss_it():
    pair = glossy(0.003, 0.5), glossy(0.0033, 0.5)
    found = estimate_errors(KEY, *pair, draw_weighted)
    assert found.rmse.standard_error < 0.05 * found.rmse.value
    assert found.rmse.value > 2 * estimate_errors(KEY, *pair, plain).rmse.value


def test_standard_errors_are_the_spread_of_repeated_estimates():
    pair = glossy(0.1, 0.5), glossy(0.11, 0.45)
    runs = [estimate_errors(jax.random.key(s), *pair, draw_weighted, pairs=2**12, chunk=2**12) for s in range(60)]
    for name in ("mae", "smape", "rmse", "log_rmse"):
        spread = np.std([getattr(r, name).value for r in runs], ddof=1)
        claimed = np.mean([getattr(r, name).standard_error for r in runs])
        # a spread of 60 values is known to about 10 percent; the fixed halves of each draw only lower it
        assert 0.6 < spread / claimed < 1.4, name


def test_the_same_pairs_for_every_prediction_and_for_the_arrays():
    drawn = list(true_pairs(KEY, glossy(0.3, 0.4), draw_weighted, pairs=2**12, chunk=2**12))
    many = compare_at(drawn, {"a": glossy(0.2, 0.5), "b": flat(0.1)})
    assert compare_at(drawn, {"a": glossy(0.2, 0.5)})["a"] == many["a"]
    alone = estimate_errors(KEY, glossy(0.2, 0.5), glossy(0.3, 0.4), draw_weighted, pairs=2**12, chunk=2**12)
    assert many["a"] == alone
    query, importance = jax.jit(draw_weighted, static_argnums=1)(jax.random.fold_in(KEY, 0), 2**12)
    arrays = errors(glossy(0.2, 0.5)(query), glossy(0.3, 0.4)(query), importance, query.wi[:, 2])
    np.testing.assert_allclose(arrays.rmse, alone.rmse, rtol=1e-6)


def test_chunks_are_different_draws_and_are_rounded_up():
    found = estimate_errors(KEY, flat(1.0), flat(0.0), draw_weighted, pairs=5000, chunk=2048)
    assert found.pairs == 6144
    once = estimate_errors(KEY, flat(1.0), flat(0.0), draw_weighted, pairs=2048, chunk=2048)
    assert found.mae.value != once.mae.value


def test_black_and_enormous_values_stay_finite():
    f = jnp.array([[0.0, 0.0, 0.0], [1e5, 1e5, 1e5], [0.0, 1e5, 1e-30]])
    terms = pair_terms(f, f[::-1], jnp.ones(3), jnp.array([1e-30, 1e-3, 1.0]))
    assert np.all(np.isfinite(terms))


def test_sums_keep_their_digits():
    draws = np.full(10**6, 0.1, np.float32)
    moments = add_draws(add_draws(NO_DRAWS, draws), draws)
    assert mean(moments).value == pytest.approx(float(np.float32(0.1)), rel=1e-12)


def test_root_follows_the_delta_method():
    assert root(Estimate(np.float64(4.0), np.float64(0.4))) == (2.0, 0.1)
    assert root(Estimate(np.float64(0.0), np.float64(0.0))) == (0.0, 0.0)
