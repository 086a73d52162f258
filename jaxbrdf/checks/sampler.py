"""A sampler must tell of its draws what eval and pdf tell of the same directions."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from jaxbrdf.checks.compiled import densities, draws, values
from jaxbrdf.types import Brdf, Params, Query


class Mismatch(NamedTuple):
    """Relative differences, `(...)`: of the density, and of weight times density against f cos."""

    pdf: np.ndarray
    weight: np.ndarray


def sampler_mismatch(brdf: Brdf, params: Params, wo: jax.Array, u: jax.Array) -> Mismatch:
    """How far the draws at `u` `(..., 3)` for the viewers `wo` `(..., 3)` are from `brdf.pdf` and `brdf.eval` there.

    Raises:
        ValueError: the BRDF has no sampler.
    """
    drawn = draws(brdf, params, wo, u)
    query = Query(jnp.asarray(drawn.wi), wo)
    light = values(brdf, params, query) * np.maximum(drawn.wi[..., 2:], 0.0)
    weighted = drawn.weight * drawn.pdf[..., None]
    return Mismatch(_relative(drawn.pdf, densities(brdf, params, query)), _relative(weighted, light).max(axis=-1))


def _relative(a: ArrayLike, b: ArrayLike) -> np.ndarray:
    a, b = np.asarray(a), np.asarray(b)
    larger = np.maximum(np.abs(a), np.abs(b))
    return np.abs(a - b) / np.where(larger > 0, larger, 1.0)
