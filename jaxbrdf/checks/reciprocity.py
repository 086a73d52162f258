"""Helmholtz reciprocity: f(wi, wo) = f(wo, wi)."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.types import Brdf, Params, Query


def asymmetry(brdf: Brdf, params: Params, query: Query) -> jax.Array:
    """|f(wi, wo) - f(wo, wi)| / (f(wi, wo) + f(wo, wi)) per channel, `(..., 3)`; zero where both vanish."""
    there = brdf.eval(params, query)
    back = brdf.eval(params, query._replace(wi=query.wo, wo=query.wi))
    total = there + back
    return jnp.where(total > 0, jnp.abs(there - back) / jnp.where(total > 0, total, 1.0), 0.0)
