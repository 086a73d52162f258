"""Analytic models by least squares: Levenberg and Marquardt's method from several starts at once, within bounds."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from jaxbrdf.fit.bounds import from_free, to_free
from jaxbrdf.types import Params

STEPS = 60
PULL = 1e-2
"""Residuals are joined by this times each free number, or one whose best value lies at the end of its range would walk
towards infinity: a free number of 10 adds as much to the sum of squares as one residual of 0.1."""

TOLERANCE = 1e-5
"""Relative decrease of the sum of squares at which a start has arrived: far below what measured data can tell."""

LEAST_STEP = 1e-4
"""Of free numbers, at which a start has arrived too: about what float32 residuals leave of their sum's slope."""

FIRST_DAMPING, EASED, REFUSED = 1.0, 5.0, 3.0
"""The damping before the first look, and its factors after a step that is taken and one that is not."""

LEAST_SINGULAR = 1e-6
"""Of columns of length one: float32 leaves that much of a derivative that is zero."""


class LeastSquares(NamedTuple):
    """The best of all starts.

    Attributes:
        params: within their ranges.
        cost: mean square of the residuals there, `()`.
        start_costs: where each start arrived, `(starts,)`; infinite where one was lost.
        steps: of the longest way, `()`.
    """

    params: Params
    cost: jax.Array
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
    unravel = ravel_pytree(jax.tree.map(lambda leaf: leaf[0], starts))[1]

    def held(x: jax.Array) -> tuple[jax.Array, jax.Array]:
        r = residuals(from_free(unravel(x)), data)
        return jnp.concatenate([r, PULL * x]), jnp.mean(jnp.square(r))

    def descend(start: Params) -> _Descent:
        return _descend(held, ravel_pytree(to_free(start))[0])

    ends = jax.vmap(descend)(starts)
    costs = jnp.where(jnp.isfinite(ends.cost), ends.cost, jnp.inf)
    params = from_free(unravel(ends.x[jnp.argmin(costs)]))
    return LeastSquares(params, jnp.min(costs), costs, jnp.max(ends.steps))


class _Descent(NamedTuple):
    """One start on its way.

    Attributes:
        x: where it is, `(n,)`.
        cost: mean square of the residuals there, without what holds the free numbers.
        squares: half the sum of squares there, with it; infinite before the first look.
        gradient, normal: J^T r and J^T J there.
        damping: of the next step, in units of the diagonal of J^T J.
        steps: taken or refused.
        has_arrived: whether the last step changed next to nothing.
    """

    x: jax.Array
    cost: jax.Array
    squares: jax.Array
    gradient: jax.Array
    normal: jax.Array
    damping: jax.Array
    steps: jax.Array
    has_arrived: jax.Array


def _descend(held: Callable[[jax.Array], tuple[jax.Array, jax.Array]], start: jax.Array) -> _Descent:
    """Levenberg's (1944) steps in Marquardt's (1963) units: (J^T J + d diag J^T J) step = -J^T r.

    The damping falls after a step that is taken and grows after one that is refused. The first step has no gradient
    yet and leads nowhere, so that one text of `held` and its derivative serves all.
    """

    def look(x: jax.Array) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
        r, cost = held(x)
        return r, (r, cost)

    def goes_on(at: _Descent) -> jax.Array:
        return ~at.has_arrived & (at.steps < STEPS)

    def advance(at: _Descent) -> _Descent:
        step = _damped_step(at)
        jacobian, (r, cost) = jax.jacfwd(look, has_aux=True)(at.x + step)
        squares = 0.5 * jnp.sum(r * r)
        is_taken = squares < at.squares
        stays = is_taken & (at.squares - squares < TOLERANCE * squares)
        has_arrived = (at.steps > 0) & (stays | (jnp.max(jnp.abs(step)) < LEAST_STEP))
        there = at._replace(x=at.x + step, cost=cost, squares=squares, damping=at.damping / EASED)
        there = there._replace(gradient=jacobian.T @ r, normal=jacobian.T @ jacobian)
        chosen = jax.tree.map(partial(jnp.where, is_taken), there, at._replace(damping=at.damping * REFUSED))
        return chosen._replace(steps=at.steps + 1, has_arrived=has_arrived)

    lost, damping = jnp.array(jnp.inf), jnp.array(FIRST_DAMPING)
    none, unit = jnp.zeros(start.size), jnp.eye(start.size)
    first = _Descent(start, lost, lost, none, unit, damping, jnp.array(0), jnp.array(False))
    return jax.lax.while_loop(goes_on, advance, first)


def _damped_step(at: _Descent) -> jax.Array:
    """In units in which the diagonal of J^T J is one; it is not zero, for every free number is held."""
    unit = jnp.sqrt(jnp.diag(at.normal))
    scaled = at.normal / (unit[:, None] * unit[None, :]) + at.damping * jnp.eye(unit.size)
    factor = jax.scipy.linalg.cho_factor(scaled)
    return -jax.scipy.linalg.cho_solve(factor, at.gradient / unit) / unit


@partial(jax.jit, static_argnums=(0, 3))
def best_starts(residuals: Callable[[Params, Any], jax.Array], starts: Params, data: Any, count: int) -> Params:
    """The `count` starts of the least cost, best first."""
    costs = jax.lax.map(lambda start: jnp.mean(jnp.square(residuals(start, data))), starts)
    chosen = jnp.argsort(jnp.where(jnp.isfinite(costs), costs, jnp.inf))[:count]
    return jax.tree.map(lambda leaf: leaf[chosen], starts)


def covariance(residuals: Callable[[Params, Any], jax.Array], params: Params, data: Any) -> np.ndarray:
    """s^2 (J^T J)^-1 of the parameters in flattening order, `(n, n)` in float64.

    As if residuals were independent and equally uncertain by what is left of them, and no range had an end. Of a
    combination of parameters that the data do not determine it is huge.
    """
    jacobian, rest = (np.asarray(x, np.float64) for x in _slope(residuals, params, data))
    size = np.linalg.norm(jacobian, axis=0)
    unit = np.where(size > 0, size, 1.0)
    _, singular, directions = np.linalg.svd(jacobian / unit, full_matrices=False)
    root = directions.T / np.maximum(singular, LEAST_SINGULAR) / unit[:, None]
    return root @ root.T * np.sum(rest * rest) / (rest.size - unit.size)


@partial(jax.jit, static_argnums=0)
def _slope(residuals: Callable[[Params, Any], jax.Array], params: Params, data: Any) -> tuple[jax.Array, jax.Array]:
    """The residuals' derivative by the parameters `(m, n)`, and the residuals."""
    flat, unravel = ravel_pytree(params)
    return jax.jacfwd(lambda x: residuals(unravel(x), data))(flat), residuals(params, data)
