"""The fit of an analytic model: starts drawn, the best of them followed down by least squares."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from typing import Any

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
    truth: Any
    seed: int


def solve_for(problem: Problem, reporter: Reporter) -> Trained:
    """The parameters of least squared logarithmic error, with their standard errors among the findings.

    Raises:
        FitError: if no start leads anywhere.
    """
    reporter.say(f"solving for {problem.model} at {PAIRS:,} pairs of directions")
    key_pairs, key_starts = jax.random.split(jax.random.key(problem.seed))
    clock = time.perf_counter()
    query, importance = draw_weighted(key_pairs, PAIRS)
    data = (query, importance, problem.truth(query))
    start = partial(ANALYTIC[problem.model].start, config=problem.config)
    starts = jax.vmap(start)(jax.random.split(key_starts, STARTS))
    drawn = time.perf_counter() - clock
    residuals = _residuals(ANALYTIC[problem.model].build(problem.config))
    run = partial(_solve, residuals, starts, data)
    clock = time.perf_counter()
    jax.block_until_ready(run())
    first = time.perf_counter() - clock
    clock = time.perf_counter()
    solution = jax.block_until_ready(run())
    again = time.perf_counter() - clock
    if not np.isfinite(solution.cost):
        raise FitError(f"{problem.model}: no start led to a finite error")
    cost = {"fit_seconds": drawn + again, "draw_seconds": drawn, "compile_seconds": max(first - again, 0.0)}
    params = jax.tree.map(np.asarray, solution.params)
    findings = {"parameters": uncertainties(solution), "start_costs": np.asarray(solution.start_costs).tolist()}
    return Trained(params, int(solution.steps), cost, findings)


def uncertainties(solution: LeastSquares) -> dict[str, dict[str, Any]]:
    """Each parameter's value and standard error by name."""
    errors = np.sqrt(np.maximum(np.diag(np.asarray(solution.covariance)), 0.0))
    found, at = {}, 0
    for name, leaf in named_leaves(solution.params).items():
        own = errors[at : at + leaf.size].reshape(leaf.shape)
        found[name] = {"value": np.asarray(leaf).tolist(), "standard_error": own.tolist()}
        at += leaf.size
    return found


def _residuals(brdf: Brdf) -> Any:
    """Differences of ln(f + `SMAPE_OFFSET`), as SMAPE has them where they are small, weighed as the metrics are."""

    def residuals(params: Params, data: tuple[Query, jax.Array, jax.Array]) -> jax.Array:
        query, importance, truth = data
        difference = jnp.log(brdf.eval(params, query) + SMAPE_OFFSET) - jnp.log(truth + SMAPE_OFFSET)
        return (jnp.sqrt(importance)[:, None] * difference).ravel()

    return residuals


def _solve(residuals: Any, starts: Params, data: Any) -> LeastSquares:
    few = jax.tree.map(lambda leaf: leaf[:: PAIRS // SCREENING_PAIRS], data)
    return solve(residuals, best_starts(residuals, starts, few, FOLLOWED), data)
