"""Sampling for a BRDF that brings none: by the cosine."""

from __future__ import annotations

from collections.abc import Callable

import jax

from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.sampling.proposal import COSINE
from jaxbrdf.types import Brdf, Params, Query


def cosine_sampled(evaluate: Callable[[Params, Query], jax.Array]) -> Brdf:
    """The BRDF `evaluate` with cosine-distributed light: exact in expectation, noisy for sharp highlights."""
    return sampled_by(COSINE, evaluate, lambda params: Proposed(params, None))
