"""The reflectance of a whole footprint by Monte Carlo (Timonen et al., Eq. 1), unbiased at any number of samples.

    f(wi, wo | uv, J) = integral of w(x) f(wi, wo | uv + J x) over x

w is the unit filter, a Gaussian of standard deviation 1/2, and J the footprint, which takes it to uv. The paper prints
w(J x) / det J, which does not integrate to one; with w(J^-1 x) / det J, and J x for x, it is the line above.

The points are Sobol's, moved around the unit square by a random shift of every query and mapped to the Gaussian: each
point alone is distributed as w, so that the mean is unbiased, and together they are even, so that its noise falls
faster than that of independent ones. How much it is shows in the spread between shifts.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import match_rank
from jaxbrdf.core.staging import staged
from jaxbrdf.sampling.sobol import rotate, sobol_points
from jaxbrdf.types import NoisyValue, Params, Query

FILTER_DEVIATION = 0.5
"""Of the unit filter along each axis."""

LEAST_SHIFTS = 4
"""From which a standard error is taken: its own is then two fifths of it."""


def prefiltered(
    evaluate: Callable[[Params, Query], jax.Array], *, samples: int
) -> Callable[[jax.Array, Params, Query], jax.Array]:
    """An unbiased estimator of the footprint's mean, `(key, params, query) -> f`, `(..., 3)`.

    Without a footprint it is `evaluate` itself.

    Args:
        evaluate: `(params, query) -> f` at points.
        samples: points of the footprint, a power of two for the least noise.

    Raises:
        ValueError: fewer than one sample.
    """
    points = sobol_points(samples, 2)

    def estimate(key: jax.Array, params: Params, query: Query) -> jax.Array:
        if query.footprint is None:
            return evaluate(params, query)
        shift = jax.random.uniform(key, (*query.wi.shape[:-1], 2), query.wi.dtype)

        def add(sum_: jax.Array, point: jax.Array) -> tuple[jax.Array, None]:
            x = gaussian_point(rotate(match_rank(point, shift.ndim), shift))
            return sum_ + evaluate(params, query_at(query, x)), None

        total, _ = jax.lax.scan(add, jnp.zeros_like(query.wi), jnp.asarray(points, query.wi.dtype))
        return total / samples

    return estimate


def reference(
    key: jax.Array,
    evaluate: Callable[[Params, Query], jax.Array],
    params: Params,
    query: Query,
    *,
    error: float,
    floor: float = 1e-3,
    samples: int = 1024,
    most_shifts: int = 1024,
) -> NoisyValue:
    """The footprint's mean to a stated error, by as many random shifts as that takes.

    Shifts are added, doubling their number, until every standard error is at most `error` (f + floor), or at the most
    shifts; what was reached is returned beside the value.

    Args:
        key, params, query: as `prefiltered`.
        evaluate: compiled here, once.
        error: relative standard error.
        floor: of f [1/sr], below which the error is absolute.
        samples: points of one shift.
        most_shifts: where it stops at the latest.
    """
    estimate = jax.jit(prefiltered(evaluate, samples=samples))
    values: list[jax.Array] = []
    found = NoisyValue(jnp.zeros_like(query.wi), jnp.full_like(query.wi, jnp.inf))
    wanted = LEAST_SHIFTS
    while len(values) < most_shifts and bool(jnp.any(found.standard_error > error * (found.value + floor))):
        keys = [jax.random.fold_in(key, index) for index in range(len(values), min(wanted, most_shifts))]
        values += [estimate(k, params, query) for k in keys]
        found = _mean(jnp.stack(values))
        wanted *= 2
    return found


def _mean(values: jax.Array) -> NoisyValue:
    return NoisyValue(jnp.mean(values, axis=0), jnp.std(values, axis=0, ddof=1) / jnp.sqrt(float(len(values))))


def query_at(query: Query, x: jax.Array) -> Query:
    """The query at the point x `(..., 2)` of its unit filter: uv + J x, and no footprint.

    uv is staged: every read of every texel would compute it again, which takes four times as long as all the rest.
    """
    assert query.uv is not None
    assert query.footprint is not None
    moved = query.footprint[..., 0] * x[..., :1] + query.footprint[..., 1] * x[..., 1:]
    return query._replace(uv=staged(query.uv + moved), footprint=None)


def gaussian_point(u: jax.Array) -> jax.Array:
    """A point of the unit filter, `(..., 2)`, of u in [0, 1)^2 (Box and Muller)."""
    radius = FILTER_DEVIATION * jnp.sqrt(-2.0 * jnp.log1p(-u[..., 0]))
    phi = 2.0 * jnp.pi * u[..., 1]
    return jnp.stack([radius * jnp.cos(phi), radius * jnp.sin(phi)], axis=-1)
