"""Queries on which reflectance code likes to break, each with its reason, and the test that value and gradient hold."""

from __future__ import annotations

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
    by_directions = _gradient_is_finite(lambda wi, wo: brdf.eval(params, Query(wi, wo)), query)
    lit = (query.wi[:, 2] > 0) & (query.wo[:, 2] > 0)
    f = brdf.eval(params, query)
    faults = {
        "value is not finite": ~jnp.isfinite(f).all(-1),
        "value is negative": (f < 0).any(-1),
        "value below the horizon is not zero": ~lit & (f != 0).any(-1),
        "gradient by a direction is not finite": ~by_directions,
    }
    if through_params:
        faults["gradient by a parameter is not finite"] = ~_gradient_by_params_is_finite(brdf, params, query)
    return [Finding(HARD_QUERIES[i], fault) for fault, bad in faults.items() for i in np.flatnonzero(np.asarray(bad))]


def _gradient_is_finite(f, query: Query) -> jax.Array:
    """Whether each query's derivatives by its own two directions are finite, `(n,)`."""
    gradients = jax.jit(jax.vmap(jax.grad(lambda wi, wo: jnp.sum(f(wi, wo)), argnums=(0, 1))))(query.wi, query.wo)
    return jnp.isfinite(jnp.concatenate(gradients, axis=-1)).all(-1)


def _gradient_by_params_is_finite(brdf: Brdf, params: Params, query: Query) -> jax.Array:
    by_params = jax.grad(lambda p, wi, wo: jnp.sum(brdf.eval(p, Query(wi, wo))))
    leaves = jax.tree.leaves(jax.jit(jax.vmap(by_params, in_axes=(None, 0, 0)))(params, query.wi, query.wo))
    finite = [jnp.isfinite(leaf).reshape(leaf.shape[0], -1).all(-1) for leaf in leaves]
    return jnp.stack(finite).all(0)
