"""Ideal diffuse reflection.

Parameters: albedo, `(3,)` or of the batch shape `(..., 3)`, in [0, 1]. f = albedo / pi (Lambert 1760).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.core.directions import above_horizon
from jaxbrdf.core.numerics import match_rank
from jaxbrdf.core.ranges import SHARE
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine
from jaxbrdf.types import Brdf, Query, Sample


class LambertParams(NamedTuple):
    """albedo: share of light reflected, for R, G and B."""

    albedo: Annotated[jax.Array, SHARE]


def _eval(params: LambertParams, query: Query) -> jax.Array:
    lit = above_horizon(query.wi, query.wo)[..., None]
    return jnp.where(lit, match_rank(params.albedo, query.wi.ndim) / jnp.pi, 0.0)


def _sample(params: LambertParams, query: Query, u: jax.Array) -> Sample:
    wi = square_to_cosine(u[..., 1:])
    lit = above_horizon(wi, query.wo)
    albedo = match_rank(params.albedo, query.wo.ndim)
    return Sample(wi, jnp.where(lit, cosine_density(wi), 0.0), jnp.where(lit[..., None], albedo, 0.0))


def _albedo(params: LambertParams, query: Query) -> jax.Array:
    return jnp.broadcast_to(match_rank(params.albedo, query.wo.ndim), query.wo.shape)


def _pdf(params: LambertParams, query: Query) -> jax.Array:
    return jnp.where(above_horizon(query.wi, query.wo), cosine_density(query.wi), 0.0)


LAMBERT = within_ranges(Brdf(_eval, _sample, _pdf, _albedo))
