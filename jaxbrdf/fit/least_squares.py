"""Analytic models by least squares: Levenberg and Marquardt's method from several starts at once, within bounds."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import lineax as lx
import optimistix as optx
from jax.flatten_util import ravel_pytree

from jaxbrdf.fit.bounds import from_free, to_free
from jaxbrdf.types import Params

LINEAR = lx.Normal(lx.Cholesky())
"""Normal equations: residuals are many and parameters few, and the damping keeps the matrix well conditioned."""

STEPS = 60
PULL = 1e-2
"""Residuals are joined by this times each free number, or one whose best value lies at the end of its range would walk
towards infinity: a free number of 10 adds as much to the sum of squares as one residual of 0.1."""

TOLERANCE = 1e-3
"""Relative change of free numbers and cost at which a start has arrived: far below what measured data can tell."""


class LeastSquares(NamedTuple):
    """The best of all starts.

    Attributes:
        params: within their ranges.
        cost: mean square of the residuals there, `()`.
        covariance: of the parameters in flattening order, `(n, n)`, if residuals are independent and equally uncertain
            by what is left of them; infinite along what the data do not determine.
        start_costs: where each start arrived, `(starts,)`; infinite where one was lost.
        steps: of the longest way, `()`.
    """

    params: Params
    cost: jax.Array
    covariance: jax.Array
    start_costs: jax.Array
    steps: jax.Array


@partial(jax.jit, static_argnums=0)
def solve(residuals: Callable[[Params, Any], jax.Array], starts: Params, data: Any) -> LeastSquares:
    """Parameters whose `residuals(params, data)`, `(m,)`, have the least sum of squares.

    Args:
        residuals: a function of valid parameters; compiled once for each function and shape.
        starts: records with a leading axis of starts; each within its ranges.
        data: whatever the residuals need.
    """

    def of_free(free: Params, data: Any) -> jax.Array:
        return residuals(from_free(free), data)

    def held(free: Params, data: Any) -> jax.Array:
        return jnp.concatenate([of_free(free, data), PULL * ravel_pytree(free)[0]])

    def descend(start: Params) -> tuple[Params, jax.Array, jax.Array]:
        solver = optx.LevenbergMarquardt(rtol=TOLERANCE, atol=TOLERANCE, linear_solver=LINEAR)
        found = optx.least_squares(held, solver, to_free(start), data, max_steps=STEPS, throw=False)
        cost = jnp.mean(jnp.square(of_free(found.value, data)))
        return found.value, jnp.where(jnp.isfinite(cost), cost, jnp.inf), found.stats["num_steps"]

    free, costs, steps = jax.vmap(descend)(starts)
    best = jax.tree.map(lambda leaf: leaf[jnp.argmin(costs)], free)
    covariance = _covariance(partial(of_free, data=data), best)
    return LeastSquares(from_free(best), jnp.min(costs), covariance, costs, jnp.max(steps))


@partial(jax.jit, static_argnums=(0, 3))
def best_starts(residuals: Callable[[Params, Any], jax.Array], starts: Params, data: Any, count: int) -> Params:
    """The `count` starts of the least cost, best first."""
    costs = jax.lax.map(lambda start: jnp.mean(jnp.square(residuals(start, data))), starts)
    chosen = jnp.argsort(jnp.where(jnp.isfinite(costs), costs, jnp.inf))[:count]
    return jax.tree.map(lambda leaf: leaf[chosen], starts)


def _covariance(residuals: Callable[[Params], jax.Array], free: Params) -> jax.Array:
    """s^2 (J^T J)^-1 of the free numbers, carried over to the parameters by the transformation's slope."""
    flat, unravel = ravel_pytree(free)
    at = residuals(free)
    jacobian = jax.jacfwd(lambda x: residuals(unravel(x)))(flat)
    slope = jax.jacfwd(lambda x: ravel_pytree(from_free(unravel(x)))[0])(flat)
    left = jnp.sum(at * at) / (at.size - flat.size)
    return slope @ _inverse(jacobian.T @ jacobian) @ slope.T * left


def _inverse(normal: jax.Array) -> jax.Array:
    """The inverse, after each number is given in units in which the diagonal is one."""
    unit = jnp.sqrt(jnp.maximum(jnp.diag(normal), jnp.finfo(normal.dtype).tiny))
    scaled = normal / (unit[:, None] * unit[None, :])
    return jnp.linalg.inv(scaled) / (unit[:, None] * unit[None, :])
