"""Least squares against problems whose solution and covariance are known in closed form."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.ranges import ANY, Range
from jaxbrdf.fit.least_squares import best_starts, covariance, solve


class Line(NamedTuple):
    """A straight line."""

    slope: Annotated[jax.Array, ANY]
    height: Annotated[jax.Array, ANY]


class Decay(NamedTuple):
    """An exponential with a rate that must not be negative."""

    rate: Annotated[jax.Array, Range(0.0, 10.0)]
    size: Annotated[jax.Array, Range(0.0, 5.0)]


def line_residuals(params: Line, data: tuple[jax.Array, jax.Array]) -> jax.Array:
    x, y = data
    return params.slope * x + params.height - y


def decay_residuals(params: Decay, data: tuple[jax.Array, jax.Array]) -> jax.Array:
    x, y = data
    return params.size * jnp.exp(-params.rate * x) - y


def starts_of(kind: type, low: float, high: float, count: int) -> tuple:
    grid = np.random.default_rng(0).uniform(low, high, (2, count))
    return kind(*(jnp.asarray(g, jnp.float32) for g in grid))


def test_a_line_and_its_covariance_are_the_textbooks():
    rng = np.random.default_rng(1)
    x = np.linspace(-1, 2, 400)
    y = 0.7 * x - 0.2 + 0.1 * rng.standard_normal(400)
    data = jnp.asarray(x, jnp.float32), jnp.asarray(y, jnp.float32)
    found = solve(line_residuals, starts_of(Line, -1, 1, 3), data)
    want, spread = np.polyfit(x, y, 1, cov=True)
    np.testing.assert_allclose([found.params.slope, found.params.height], want, atol=1e-3)
    np.testing.assert_allclose(covariance(line_residuals, found.params, data), spread, rtol=1e-3)
    np.testing.assert_allclose(found.cost, np.mean((np.polyval(want, x) - y) ** 2), rtol=1e-4)


def test_a_decay_is_found_within_its_bounds():
    x = jnp.linspace(0.0, 3.0, 200)
    found = solve(decay_residuals, starts_of(Decay, 0.1, 4.0, 4), (x, 2.0 * jnp.exp(-1.5 * x)))
    np.testing.assert_allclose([found.params.rate, found.params.size], [1.5, 2.0], rtol=1e-3)


def test_a_best_value_beyond_the_bound_ends_at_the_bound():
    x = jnp.linspace(0.0, 1.0, 200)
    # a free number that walks towards infinity takes more steps than there are by default
    growing = solve(decay_residuals, starts_of(Decay, 0.1, 4.0, 4), (x, jnp.exp(0.5 * x)), steps=100)
    assert float(growing.params.rate) < 5e-3
    np.testing.assert_allclose(growing.params.size, jnp.mean(jnp.exp(0.5 * x)), rtol=1e-3)


def test_a_lost_start_does_not_win():
    def residuals(params: Line, data: jax.Array) -> jax.Array:
        return jnp.where(params.slope > 5.0, jnp.nan, params.slope - data)

    found = solve(residuals, Line(jnp.array([8.0, 1.0]), jnp.zeros(2)), jnp.full(10, 2.0))
    assert np.isinf(found.start_costs[0])
    np.testing.assert_allclose(found.params.slope, 2.0, rtol=1e-3)


def test_the_nearest_starts_are_kept_in_order():
    starts = Line(jnp.array([3.0, jnp.nan, 1.1, 0.0]), jnp.zeros(4))
    x = jnp.linspace(-1.0, 1.0, 50)
    kept = best_starts(line_residuals, starts, (x, x), 2)
    np.testing.assert_allclose(kept.slope, [1.1, 0.0])


def test_what_the_data_do_not_determine_is_huge_and_leaves_the_rest():
    def residuals(params: Line, data: jax.Array) -> jax.Array:
        return params.slope - data

    y = jnp.asarray(np.random.default_rng(0).normal(2.0, 0.1, 100), jnp.float32)
    spread = covariance(residuals, Line(jnp.mean(y), jnp.array(0.0)), y)
    np.testing.assert_allclose(spread[0, 0], np.var(y) / 98, rtol=1e-3)
    assert spread[1, 1] > 1e8
