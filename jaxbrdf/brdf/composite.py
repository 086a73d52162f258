"""A sum of lobes, sampled by choosing one of them.

Parameters: lobes, one record for each lobe; selection, `(n,)`, positive, the chance of each lobe up to a common factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.sampler import Sampler, sampler_of
from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.numerics import match_rank, safe_divide
from jaxbrdf.types import Brdf, Params, Query, Sample


class CompositeParams(NamedTuple):
    """The lobes' own parameters, and the chance `(n,)` with which each is chosen."""

    lobes: tuple[Params, ...]
    selection: jax.Array


def composite(*lobes: Brdf) -> Brdf:
    """The sum of `lobes`; every one must have a sampler and a density.

    The density is the mixture of the lobes', and a sample's weight is the whole sum's f cos / pdf.

    Raises:
        ValueError: a lobe that cannot be sampled.
    """
    samplers = [sampler_of(lobe) for lobe in lobes]

    def evaluate(params: CompositeParams, query: Query) -> jax.Array:
        return jnp.sum(
            jnp.stack([lobe.eval(own, query) for lobe, own in zip(lobes, params.lobes, strict=True)]), axis=0
        )

    def pdf(params: CompositeParams, query: Query) -> jax.Array:
        densities = [sampler.pdf(own, query) for sampler, own in zip(samplers, params.lobes, strict=True)]
        chance = params.selection / jnp.sum(params.selection)
        return jnp.sum(jnp.stack(densities, axis=-1) * match_rank(chance, query.wi.ndim), axis=-1)

    def sample(params: CompositeParams, query: Query, u: jax.Array) -> Sample:
        wi = _choose_and_sample(samplers, params, query, u)
        drawn = query._replace(wi=wi)
        density = pdf(params, drawn)
        gain = safe_divide(jnp.maximum(cos_theta(wi), 0.0), density)
        return Sample(wi, density, evaluate(params, drawn) * gain[..., None])

    return Brdf(evaluate, sample, pdf)


def _choose_and_sample(samplers: Sequence[Sampler], params: CompositeParams, query: Query, u: jax.Array) -> jax.Array:
    """Directions from the lobe that u[0] falls into; what u[0] has left is stretched and handed on."""
    chance = params.selection / jnp.sum(params.selection)
    start = jnp.cumsum(chance) - chance
    wi = jnp.zeros_like(query.wo)
    for index, (sampler, own) in enumerate(zip(samplers, params.lobes, strict=True)):
        rest = jnp.clip((u[..., 0] - start[index]) / chance[index], 0.0, 1.0)
        drawn = sampler.sample(own, query, jnp.concatenate([rest[..., None], u[..., 1:]], axis=-1)).wi
        wi = jnp.where((u[..., 0] >= start[index])[..., None], drawn, wi)
    return wi
