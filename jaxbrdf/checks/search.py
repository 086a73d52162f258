"""A search for values or gradients that are not finite, at random parameters and demanding directions."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.extremes import random_stack
from jaxbrdf.checks.finite import count_faults
from jaxbrdf.checks.parity import demanding_queries
from jaxbrdf.types import Brdf, Params, Query


def search_faults(
    key: jax.Array, brdf: Brdf, params: Params, *, count: int, variants: int = 32, queries: int = 32
) -> int:
    """How many of at least `count` evaluations with their gradients are not finite.

    Args:
        key: draws parameters over their declared ranges, and directions by `demanding_queries`.
        brdf: the reflectance.
        params: floating point throughout; what declares no range keeps its value.
        count: of pairs of parameters and directions, in rounds of `variants` times `queries`.
    """
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)).tolist())
    pool = [np.asarray(w) for w in demanding_queries(key, count=2048)[:2]]
    faults = 0
    for _ in range(-(-count // (variants * queries))):
        rows = rng.integers(0, len(pool[0]), queries)
        query = Query(*(jnp.asarray(w[rows]) for w in pool))
        faults += count_faults(brdf, random_stack(rng, params, variants), query)
    return faults
