"""A sum of lobes, sampled by choosing one of them.

Parameters: lobes, one record for each lobe; selection, `(n,)`, the chance of each lobe up to a common factor.
"""

from __future__ import annotations

from functools import reduce
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.core.ranges import Range
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.types import Brdf, Params, Query, Sample


class CompositeParams(NamedTuple):
    """The lobes' own parameters, and the chance `(n,)` or `(..., n)` of each, at least one of them positive."""

    lobes: tuple[Params, ...]
    selection: Annotated[jax.Array, Range(0.0, np.inf)]


def composite(*lobes: Brdf) -> Brdf:
    """The sum of `lobes`; every one must have a sampler and a density.

    The density is the mixture of the lobes', and a sample's weight is the whole sum's f cos / pdf.

    Raises:
        ValueError: a lobe that cannot be sampled.
    """
    samplers = [sampler_of(lobe) for lobe in lobes]

    def evaluate(params: CompositeParams, query: Query) -> jax.Array:
        return reduce(jnp.add, (lobe.eval(own, query) for lobe, own in zip(lobes, params.lobes, strict=True)))

    def pdf(params: CompositeParams, query: Query) -> jax.Array:
        densities = [sampler.pdf(own, query) for sampler, own in zip(samplers, params.lobes, strict=True)]
        return blend(params.selection, densities)

    def sample(params: CompositeParams, query: Query, u: jax.Array) -> Sample:
        draws = [
            lambda v, sampler=sampler, own=own: sampler.sample(own, query, v).wi
            for sampler, own in zip(samplers, params.lobes, strict=True)
        ]
        wi = choose(params.selection, draws, u)
        drawn = query._replace(wi=wi)
        density = pdf(params, drawn)
        gain = safe_divide(jnp.maximum(cos_theta(wi), 0.0), density)
        return Sample(wi, density, evaluate(params, drawn) * gain[..., None])

    return Brdf(evaluate, sample, pdf)
