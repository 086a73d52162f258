"""A sampler for reflectances that have none, such as learned models."""

from __future__ import annotations

import jax.numpy as jnp

from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.sampling.mixture import MixtureParams, mixture
from jaxbrdf.sampling.proposal import COSINE, VISIBLE_NORMALS
from jaxbrdf.types import Brdf, Params

# Widths a factor of five apart, so that any lobe wider than the least is within about a factor of two of one of them.
ROUGHNESS = (0.02, 0.1, 0.5)
_PROPOSAL = mixture(COSINE, *[VISIBLE_NORMALS] * len(ROUGHNESS))


def with_sampler(brdf: Brdf) -> Brdf:
    """The BRDF itself if it can be sampled, else with cosine and visible-normal draws of several widths mixed."""
    if brdf.sample is not None and brdf.pdf is not None:
        return brdf
    return sampled_by(_PROPOSAL, brdf.eval, _with_equal_chances)


def _with_equal_chances(params: Params) -> Proposed:
    lobes = [Ggx(Isotropic(jnp.float32(alpha))) for alpha in ROUGHNESS]
    return Proposed(params, MixtureParams((None, *lobes), jnp.ones(1 + len(lobes))))
