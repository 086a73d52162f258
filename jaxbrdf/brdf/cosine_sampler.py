"""Sampling for a BRDF that brings none: by the cosine."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import cos_theta
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine
from jaxbrdf.types import Brdf, Params, Query, Sample


def cosine_sampled(evaluate: Callable[[Params, Query], jax.Array]) -> Brdf:
    """The BRDF `evaluate` with cosine-distributed light: exact in expectation, noisy for sharp highlights."""

    def pdf(params: Params, query: Query) -> jax.Array:
        del params
        return jnp.where(cos_theta(query.wo) > 0, cosine_density(query.wi), 0.0)

    def sample(params: Params, query: Query, u: jax.Array) -> Sample:
        wi = square_to_cosine(u[..., 1:3])
        drawn = query._replace(wi=wi)
        return Sample(wi, pdf(params, drawn), evaluate(params, drawn) * jnp.pi)

    return Brdf(evaluate, sample, pdf)
