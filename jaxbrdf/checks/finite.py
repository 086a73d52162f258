"""The test that value and gradient hold on every hard query."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import DTypeLike

from jaxbrdf.checks.hard import HARD_QUERIES, HardQuery, hard_queries
from jaxbrdf.types import Brdf, Params, Query


class Finding(NamedTuple):
    """A hard query whose value or gradient is not finite, or whose value is negative or lit below the horizon.

    Attributes:
        query: which.
        fault: what is wrong there.
        variant: of the stack's parameters, zero where there is one only.
    """

    query: HardQuery
    fault: str
    variant: int = 0


def find_faults(
    brdf: Brdf, params: Params, *, dtype: DTypeLike = jnp.float32, through_params: bool = True
) -> list[Finding]:
    """Every hard query on which `brdf` misbehaves; an empty list is a pass.

    Args:
        through_params: also take the gradient by the parameters, which must then be floating point throughout.
    """
    one = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], params)
    return find_faults_of_any(brdf, one, dtype=dtype, through_params=through_params)


def find_faults_of_any(
    brdf: Brdf, stack: Params, *, dtype: DTypeLike = jnp.float32, through_params: bool = True
) -> list[Finding]:
    """The same of many parameters, the first axis of `stack` (`jaxbrdf.checks.extremes`), compiled once."""
    query = hard_queries(dtype=dtype)
    lit = np.asarray((query.wi[:, 2] > 0) & (query.wo[:, 2] > 0))
    f, by_params, by_directions = map(np.asarray, _answers(brdf, through_params, stack, query))
    faults = {
        "value is not finite": ~np.isfinite(f).all(-1),
        "value is negative": (f < 0).any(-1),
        "value below the horizon is not zero": ~lit & (f != 0).any(-1),
        "gradient by a direction is not finite": ~by_directions,
        "gradient by a parameter is not finite": ~by_params,
    }
    return [Finding(HARD_QUERIES[i], fault, int(v)) for fault, bad in faults.items() for v, i in np.argwhere(bad)]


def count_faults(brdf: Brdf, stack: Params, query: Query) -> int:
    """Parameters and queries whose value, or its gradient by the directions or a parameter, is not finite.

    Args:
        stack: floating point throughout, with a first axis.
        query: `(n, 3)`; each is asked of each of the stack's parameters.
    """
    f, by_params, by_directions = map(np.asarray, _answers(brdf, True, stack, query))
    return int(np.sum(~(np.isfinite(f).all(-1) & by_params & by_directions)))


@partial(jax.jit, static_argnums=(0, 1))
def _answers(brdf: Brdf, through_params: bool, stack: Params, query: Query) -> tuple[jax.Array, jax.Array, jax.Array]:
    """f, and whether its derivatives by the parameters, if wanted, and by both directions are finite.

    For each parameters and query: `(variants, queries, 3)` and `(variants, queries)`. The derivatives themselves stay
    inside: by a network's textures they are thousands of times as large.
    """

    def answer(params: Params, wi: jax.Array, wo: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
        def total(moving: Params | None, wi: jax.Array, wo: jax.Array) -> tuple[jax.Array, jax.Array]:
            f = brdf.eval(params if moving is None else moving, Query(wi, wo))
            return jnp.sum(f), f

        moving = params if through_params else None
        (by_params, *by_directions), f = jax.grad(total, argnums=(0, 1, 2), has_aux=True)(moving, wi, wo)
        return f, _all_finite(by_params), _all_finite(by_directions)

    of_queries = jax.vmap(answer, in_axes=(None, 0, 0))
    leaves = jax.tree.leaves(stack)
    size = len(leaves[0]) if leaves else 1
    return jax.vmap(of_queries, in_axes=(0, None, None), axis_size=size)(stack, query.wi, query.wo)


def _all_finite(tree: Params) -> jax.Array:
    return jax.tree.reduce(lambda known, leaf: known & jnp.all(jnp.isfinite(leaf)), tree, jnp.asarray(True))
