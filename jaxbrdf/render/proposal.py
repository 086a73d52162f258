"""A sampler for reflectances that have none, such as learned models."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.composite import CompositeParams, composite
from jaxbrdf.brdf.ggx import GGX, GgxParams
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.fresnel import Schlick
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.types import Brdf, Params, Query, Sample

# Widths a factor of five apart, so that any lobe wider than the least is within about a factor of two of one of them.
ROUGHNESS = (0.02, 0.1, 0.5)
_PROPOSAL = sampler_of(composite(LAMBERT, *[GGX] * len(ROUGHNESS)))


def with_sampler(brdf: Brdf) -> Brdf:
    """The BRDF itself if it can be sampled, else with cosine and visible-normal draws of several widths mixed."""
    if brdf.sample is not None and brdf.pdf is not None:
        return brdf

    def sample(params: Params, query: Query, u: jax.Array) -> Sample:
        drawn = _PROPOSAL.sample(_proposal_params(), query, u)
        gain = safe_divide(jnp.maximum(cos_theta(drawn.wi), 0.0), drawn.pdf)
        return drawn._replace(weight=brdf.eval(params, query._replace(wi=drawn.wi)) * gain[..., None])

    def pdf(_: Params, query: Query) -> jax.Array:
        return _PROPOSAL.pdf(_proposal_params(), query)

    return Brdf(brdf.eval, sample, pdf)


def _proposal_params() -> CompositeParams:
    """Equal chances; colours that only the weights, which are not used, would see."""
    lobes = [GgxParams(jnp.float32(a), jnp.float32(a), Schlick(jnp.ones(3))) for a in ROUGHNESS]
    return CompositeParams((LambertParams(jnp.ones(3)), *lobes), jnp.ones(1 + len(lobes)))
