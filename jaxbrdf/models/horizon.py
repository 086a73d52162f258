"""The growth of a reflectance towards the horizon, taken out of what a model has to learn.

A gonioreflectometer sees f cos(theta_i), which stays finite where a direction grazes the surface, so f grows like its
cosine's reciprocal there, and the symmetrised f like the mean of both directions' reciprocals. No table over half and
difference
vectors can follow that: the horizon is a slanted surface in those coordinates. With one learned exponent k,

    ln f = decoder + k ln((1/cos_i + 1/cos_o) / 2)

k = 1 for what grows as measured data do, k = 0 for what stays finite. The factor is symmetric: reciprocity is kept.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import cos_theta
from jaxbrdf.types import Query

LEAST_COSINE = 1e-6
"""Keeps the factor below 1e6, where measured tables end too: their values peak at 1e7."""

FIRST_EXPONENT = 0.5


def log_mean_secant(query: Query) -> jax.Array:
    """ln((1/cos_i + 1/cos_o) / 2), `(...)`; zero at normal incidence, at most ln(1e6)."""
    cos_i = jnp.maximum(cos_theta(query.wi), LEAST_COSINE)
    cos_o = jnp.maximum(cos_theta(query.wo), LEAST_COSINE)
    return jnp.log(0.5 / cos_i + 0.5 / cos_o)
