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
    """A hard query whose value or gradient is not finite, or whose value is negative or lit below the horizon."""

    query: HardQuery
    fault: str


def find_faults(
    brdf: Brdf, params: Params, *, dtype: DTypeLike = jnp.float32, through_params: bool = True
) -> list[Finding]:
    """Every hard query on which `brdf` misbehaves; an empty list is a pass.

    Args:
        through_params: also take the gradient by the parameters, which must then be floating point throughout.
    """
    query = hard_queries(dtype=dtype)
    lit = (query.wi[:, 2] > 0) & (query.wo[:, 2] > 0)
    f = jax.jit(brdf.eval)(params, query)
    by_params, *by_directions = _gradients(brdf, params if through_params else None, params, query)
    faults = {
        "value is not finite": ~_finite(f),
        "value is negative": (f < 0).any(-1),
        "value below the horizon is not zero": ~lit & (f != 0).any(-1),
        "gradient by a direction is not finite": ~_finite(by_directions),
        "gradient by a parameter is not finite": ~_finite(by_params),
    }
    return [Finding(HARD_QUERIES[i], fault) for fault, bad in faults.items() for i in np.flatnonzero(np.asarray(bad))]


@partial(jax.jit, static_argnames="brdf")
def _gradients(brdf: Brdf, moving: Params | None, params: Params, query: Query) -> tuple[Params, jax.Array, jax.Array]:
    """Derivatives of each query's value by the parameters (if they are `moving`), by its wi and by its wo."""

    def total(moving: Params | None, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return jnp.sum(brdf.eval(params if moving is None else moving, Query(wi, wo)))

    return jax.vmap(jax.grad(total, argnums=(0, 1, 2)), in_axes=(None, 0, 0))(moving, query.wi, query.wo)


def _finite(tree: Params) -> jax.Array:
    """Which queries, along the leaves' first axis, have only finite entries."""
    count = len(HARD_QUERIES)
    finite = [jnp.isfinite(leaf).reshape(count, -1).all(-1) for leaf in jax.tree.leaves(tree)]
    return jnp.stack([jnp.ones(count, bool), *finite]).all(0)
