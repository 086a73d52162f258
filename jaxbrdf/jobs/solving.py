"""The fit of an analytic model: starts drawn, the best of them followed down by least squares."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.tree import named_leaves
from jaxbrdf.errors import FitError
from jaxbrdf.fit.least_squares import LeastSquares, best_starts, solve
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.training import Trained
from jaxbrdf.metrics.brdf_space import SMAPE_OFFSET
from jaxbrdf.models.table import ANALYTIC
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Brdf, Params, Query

Residuals = Callable[[Params, Any], jax.Array]

PAIRS, SCREENING_PAIRS = 4096, 512
"""Directions that the solver sees, and that choose among the starts."""

STARTS, FOLLOWED = 128, 4
"""Random parameters that are looked at, and those of them that are followed down."""


@dataclass(frozen=True)
class Problem:
    """What is solved for.

    Attributes:
        model: a key of `models.table.ANALYTIC`.
        config: what the model has.
        truth: `query -> f`, compiled.
        seed: of starts and draws.
    """

    model: str
    config: Any
    truth: Callable[[Query], jax.Array]
    seed: int


def solve_for(problem: Problem, reporter: Reporter) -> Trained:
    """The parameters of least squared logarithmic error, with their standard errors among the findings.

    Raises:
        FitError: if no start leads anywhere.
    """
    reporter.say(f"solving for {problem.model} at {PAIRS:,} pairs of directions")
    start = jax.jit(jax.vmap(partial(ANALYTIC[problem.model].start, config=problem.config)))
    starts = start(jax.random.split(_keys(problem)[1], STARTS))
    data, drawing = _timed(partial(problem_data, problem))
    residuals = residuals_of(ANALYTIC[problem.model].build(problem.config))
    solution, solving = _timed(partial(_solve, residuals, starts, data))
    if not np.isfinite(solution.cost):
        raise FitError(f"{problem.model}: no start led to a finite error")
    cost = {
        "fit_seconds": drawing.again + solving.again,
        "draw_seconds": drawing.again,
        "compile_seconds": drawing.first + solving.first - drawing.again - solving.again,
    }
    params = jax.tree.map(np.asarray, solution.params)
    findings = {"parameters": uncertainties(solution), "start_costs": np.asarray(solution.start_costs).tolist()}
    return Trained(params, int(solution.steps), cost, findings)


def problem_data(problem: Problem) -> tuple[Query, jax.Array, jax.Array]:
    """The pairs that the solver sees, their importance and the truth at them."""
    query, importance = jax.jit(draw_weighted, static_argnums=1)(_keys(problem)[0], PAIRS)
    return query, importance, problem.truth(query)


class _Seconds(NamedTuple):
    """Of a first call, which compiles, and of another."""

    first: float
    again: float


def _timed(run: Callable[[], Any]) -> tuple[Any, _Seconds]:
    """What a function gives; it is called twice."""
    seconds = []
    for _ in range(2):
        clock = time.perf_counter()
        found = jax.block_until_ready(run())
        seconds.append(time.perf_counter() - clock)
    return found, _Seconds(*seconds)


def _keys(problem: Problem) -> jax.Array:
    """One for the pairs, one for the starts."""
    return jax.random.split(jax.random.key(problem.seed))


def uncertainties(solution: LeastSquares) -> dict[str, dict[str, Any]]:
    """Each parameter's value and standard error by name."""
    errors = np.sqrt(np.maximum(np.diag(np.asarray(solution.covariance)), 0.0))
    found, at = {}, 0
    for name, leaf in named_leaves(solution.params).items():
        own = errors[at : at + leaf.size].reshape(leaf.shape)
        found[name] = {"value": np.asarray(leaf).tolist(), "standard_error": own.tolist()}
        at += leaf.size
    return found


def residuals_of(brdf: Brdf) -> Residuals:
    """Differences of ln(f + `SMAPE_OFFSET`), as SMAPE has them where they are small, weighed as the metrics are."""

    def residuals(params: Params, data: tuple[Query, jax.Array, jax.Array]) -> jax.Array:
        query, importance, truth = data
        difference = jnp.log(brdf.eval(params, query) + SMAPE_OFFSET) - jnp.log(truth + SMAPE_OFFSET)
        return (jnp.sqrt(importance)[:, None] * difference).ravel()

    return residuals


def _solve(residuals: Residuals, starts: Params, data: Any) -> LeastSquares:
    few = jax.tree.map(lambda leaf: leaf[:: PAIRS // SCREENING_PAIRS], data)
    return solve(residuals, best_starts(residuals, starts, few, FOLLOWED), data)
