"""A reciprocal factor that takes from a reflectance what it gives beyond the light that it gets.

    f'(wi, wo) = f(wi, wo) c(wi) c(wo),   log2 c = -(w_0 + w_1 t + sum of w_(2+k) max(t - k / n, 0)^2)

for each channel, t the elevation's coordinate of `jaxbrdf.core.grazing` and n = `KNOTS`: a quadratic spline, smooth up
to its slope, that needs no table lookup. The same c for light and viewer keeps f' reciprocal where f is; c <= 1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.grazing import grazing
from jaxbrdf.types import Params, Query

KNOTS = 12
TERMS = KNOTS + 2


class EnergyScale(NamedTuple):
    """weights: of the spline's terms, `(TERMS, 3)`."""

    weights: jax.Array


def scale_terms(t: jax.Array) -> jax.Array:
    """1, t and the squares beyond each knot, `(..., TERMS)`."""
    knots = jnp.arange(KNOTS, dtype=t.dtype) / KNOTS
    beyond = jnp.maximum(t[..., None] - knots.reshape((1,) * t.ndim + (KNOTS,)), 0.0)
    return jnp.concatenate([jnp.ones_like(t)[..., None], t[..., None], beyond * beyond], axis=-1)


def log2_loss(scale: EnergyScale, w: jax.Array) -> jax.Array:
    """-log2 c of directions `(..., 3)`, `(..., 3)` for R, G and B."""
    return scale_terms(grazing(w)) @ scale.weights


def scaled(
    evaluate: Callable[[Params, Query], jax.Array], split: Callable[[Params], tuple[Params, EnergyScale]]
) -> Callable[[Params, Query], jax.Array]:
    """The reflectance `evaluate` times c(wi) c(wo), of parameters that `split` parts into its own and the scale."""

    def evaluate_scaled(params: Params, query: Query) -> jax.Array:
        own, scale = split(params)
        loss = log2_loss(scale, query.wi) + log2_loss(scale, query.wo)
        return evaluate(own, query) * jnp.exp2(-loss)

    return evaluate_scaled
