"""Helmholtz reciprocity: f(wi, wo) = f(wo, wi)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from jaxbrdf.checks.compiled import values
from jaxbrdf.types import Brdf, Params, Query

Evaluate = Callable[[Brdf, Params, Query], Any]


def asymmetry(brdf: Brdf, params: Params, query: Query, *, evaluate: Evaluate = values) -> np.ndarray:
    """|f(wi, wo) - f(wo, wi)| / (f(wi, wo) + f(wo, wi)) per channel, `(..., 3)`; zero where both vanish.

    Args:
        brdf, params: of the material.
        query: pairs, `(..., 3)` each.
        evaluate: `(brdf, params, query) -> f`, compiled.
    """
    there = np.asarray(evaluate(brdf, params, query))
    back = np.asarray(evaluate(brdf, params, query._replace(wi=query.wo, wo=query.wi)))
    total = there + back
    return np.abs(there - back) / np.where(total > 0, total, 1.0)
