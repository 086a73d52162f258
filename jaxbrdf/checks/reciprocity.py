"""Helmholtz reciprocity: f(wi, wo) = f(wo, wi)."""

from __future__ import annotations

import numpy as np

from jaxbrdf.checks.compiled import values
from jaxbrdf.types import Brdf, Params, Query


def asymmetry(brdf: Brdf, params: Params, query: Query) -> np.ndarray:
    """|f(wi, wo) - f(wo, wi)| / (f(wi, wo) + f(wo, wi)) per channel, `(..., 3)`; zero where both vanish."""
    there = values(brdf, params, query)
    back = values(brdf, params, query._replace(wi=query.wo, wo=query.wi))
    total = there + back
    return np.abs(there - back) / np.where(total > 0, total, 1.0)
