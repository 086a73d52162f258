"""A proposal with a share of cosine-distributed draws, so that no lit direction is without density (Hesterberg 1995).

A weight f cos / pdf is then at most pi f / FLOOR, whatever a table of finite resolution or the tail of a fitted lobe
missed, and the second moment of no estimate grows by more than 1 / (1 - FLOOR).
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.sampling.mixture import MixtureParams, mixture
from jaxbrdf.sampling.proposal import COSINE, Proposal
from jaxbrdf.types import Params

FLOOR = 0.02
"""Share of the cosine: at most 2 percent of a second moment is paid for it."""


def defensive(proposal: Proposal) -> Proposal:
    """`proposal` with the share `FLOOR` of its draws taken by the cosine; its parameters are those of `proposal`."""
    mixed = mixture(COSINE, proposal)

    def sample(params: Params, wo: jax.Array, u: jax.Array) -> jax.Array:
        return mixed.sample(_mixture_params(params), wo, u)

    def pdf(params: Params, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return mixed.pdf(_mixture_params(params), wi, wo)

    return Proposal(sample, pdf)


def _mixture_params(params: Params) -> MixtureParams:
    return MixtureParams((None, params), jnp.array([FLOOR, 1.0 - FLOOR]))
