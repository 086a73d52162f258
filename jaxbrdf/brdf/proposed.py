"""A reflectance with light drawn by any proposal."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.types import Brdf, Material, Params, Query, Sample


class Proposed(NamedTuple):
    """Parameters of a reflectance and of the proposal that draws its light."""

    brdf: Params
    proposal: Params


def sampled_by(
    proposal: Proposal, evaluate: Callable[[Params, Query], jax.Array], split: Callable[[Params], Proposed]
) -> Brdf:
    """The BRDF `evaluate` with light drawn by `proposal`: exact in expectation, whatever the proposal's density.

    Only where f is not zero and the density is, which a proposal must avoid, light is lost.

    Args:
        proposal: draws the light.
        evaluate: `(params, query) -> f`.
        split: what `evaluate` and the proposal take, of the resulting BRDF's parameters.
    """

    def reflectance(params: Params, query: Query) -> jax.Array:
        return evaluate(split(params).brdf, query)

    def pdf(params: Params, query: Query) -> jax.Array:
        return proposal.pdf(split(params).proposal, query.wi, query.wo)

    def sample(params: Params, query: Query, u: jax.Array) -> Sample:
        drawn = query._replace(wi=proposal.sample(split(params).proposal, query.wo, u))
        density = pdf(params, drawn)
        gain = safe_divide(jnp.maximum(cos_theta(drawn.wi), 0.0), density)
        return Sample(drawn.wi, density, reflectance(params, drawn) * gain[..., None])

    return Brdf(reflectance, sample, pdf)


def propose(material: Material, proposal: Proposal, params: Params) -> Material:
    """The material with light drawn by `proposal` of parameters `params`; its own sampler is left out."""
    brdf = sampled_by(proposal, material.brdf.eval, Proposed._make)
    return material._replace(brdf=brdf, params=Proposed(material.params, params))
