"""A sampler must tell of its draws what eval and pdf tell of the same directions."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.types import Brdf, Params, Query


class Mismatch(NamedTuple):
    """Relative differences, `(...)`: of the density, and of weight times density against f cos."""

    pdf: jax.Array
    weight: jax.Array


def sampler_mismatch(brdf: Brdf, params: Params, wo: jax.Array, u: jax.Array) -> Mismatch:
    """How far the draws at `u` `(..., 3)` for the viewers `wo` `(..., 3)` are from `brdf.pdf` and `brdf.eval` there.

    Raises:
        ValueError: the BRDF has no sampler.
    """
    sampler = sampler_of(brdf)
    drawn = sampler.sample(params, Query(wo, wo), u)
    query = Query(drawn.wi, wo)
    light = brdf.eval(params, query) * jnp.maximum(drawn.wi[..., 2:], 0.0)
    weighted = drawn.weight * drawn.pdf[..., None]
    return Mismatch(_relative(drawn.pdf, sampler.pdf(params, query)), jnp.max(_relative(weighted, light), axis=-1))


def _relative(a: jax.Array, b: jax.Array) -> jax.Array:
    larger = jnp.maximum(jnp.abs(a), jnp.abs(b))
    return jnp.where(larger > 0, jnp.abs(a - b) / jnp.where(larger > 0, larger, 1.0), 0.0)
