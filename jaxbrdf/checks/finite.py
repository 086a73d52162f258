"""Queries on which reflectance code likes to break, each with its reason, and the test that value and gradient hold."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import DTypeLike

from jaxbrdf.types import Brdf, Params, Query

_HALF = float(np.sqrt(0.5))


class HardQuery(NamedTuple):
    """A pair of directions and what is hard about it."""

    name: str
    wi: tuple[float, float, float]
    wo: tuple[float, float, float]
    reason: str


HARD_QUERIES = (
    HardQuery("both at the normal", (0, 0, 1), (0, 0, 1), "half vector at the pole, difference vector at its pole"),
    HardQuery("retroreflection", (0.6, 0, 0.8), (0.6, 0, 0.8), "difference vector at its pole, phi_d undefined"),
    HardQuery("mirror", (_HALF, 0, _HALF), (-_HALF, 0, _HALF), "half vector exactly the normal, phi_h undefined"),
    HardQuery("almost mirror", (_HALF, 1e-7, _HALF), (-_HALF, 0, _HALF), "half vector one rounding from the normal"),
    HardQuery("mirror across y", (0, 0.6, 0.8), (0, -0.6, 0.8), "azimuth at plus and minus pi / 2"),
    HardQuery("azimuth seam", (-0.6, 0.0, 0.8), (-0.6, -0.0, 0.8), "atan2 jumps between pi and -pi at a signed zero"),
    HardQuery("light at the horizon", (1, 0, 0), (0, 0, 1), "cosine exactly zero, the value's discontinuity"),
    HardQuery("viewer at the horizon", (0, 0, 1), (0, 1, 0), "cosine exactly zero, the value's discontinuity"),
    HardQuery("both at the horizon", (1, 0, 0), (0, 1, 0), "both cosines exactly zero"),
    HardQuery("opposed at the horizon", (1, 0, 0), (-1, 0, 0), "the half vector has length zero"),
    HardQuery("opposed, just above", (1, 0, 1e-8), (-1, 0, 1e-8), "the half vector is made of rounding errors"),
    HardQuery("opposed, tiny", (1, 0, 1e-30), (-1, 0, 1e-30), "squares of the half vector underflow"),
    HardQuery("grazing", (0.8, 0.6, 1e-4), (-0.8, 0.6, 1e-4), "1 / (cos cos) is 1e8"),
    HardQuery("grazing mirror", (1, 0, 1e-6), (-1, 0, 1e-6), "1 / (cos cos) is 1e12 at the lobe's peak"),
    HardQuery("grazing retro", (1, 0, 1e-7), (1, 0, 1e-7), "half vector at the horizon"),
    HardQuery("light tiny above", (1, 0, 1e-38), (0, 0, 1), "the cosine is subnormal"),
    HardQuery("light below", (0.6, 0, -0.8), (0, 0, 1), "below the horizon, the value must be zero"),
    HardQuery("both below", (0, 0.6, -0.8), (0, -0.6, -0.8), "below the horizon, squares hide the sign"),
    HardQuery("opposed through the surface", (0.6, 0, 0.8), (-0.6, 0, -0.8), "the half vector has length zero"),
    HardQuery("not quite unit", (0.6000001, 0, 0.8000001), (0.6000001, 0, 0.8000001), "inner products exceed one"),
)


class Finding(NamedTuple):
    """A hard query whose value or gradient is not finite, or whose value is negative or lit below the horizon."""

    query: HardQuery
    fault: str


def hard_queries(*, dtype: DTypeLike = jnp.float32) -> Query:
    """The table's directions as arrays `(n, 3)`."""
    return Query(jnp.array([q.wi for q in HARD_QUERIES], dtype), jnp.array([q.wo for q in HARD_QUERIES], dtype))


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
