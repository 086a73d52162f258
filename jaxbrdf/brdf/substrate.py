"""A diffuse body under a smooth dielectric surface, without the reflection off the surface itself.

Light enters with 1 - F(cos_i), scatters diffusely, meets the surface from within any number of times (each time the
share R_in stays) and leaves with 1 - F(cos_o):

    f = albedo / pi (1 - F(cos_i)) (1 - F(cos_o)) / (eta^2 (1 - R_in albedo)),   R_in = 1 - (1 - R_out) / eta^2

with R_out the diffuse reflectance from outside (Egan and Hilgeman 1979, for the diffuse terms). Reciprocal, and white
with a specular interface on top when albedo is one.

Parameters: albedo, `(3,)` or `(..., 3)`; eta, `()` or `(...)`, refractive index of the surface, from one on.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.rough_interface import facet_transmittance
from jaxbrdf.core.directions import above_horizon, cos_theta
from jaxbrdf.core.fresnel import diffuse_reflectance
from jaxbrdf.core.numerics import match_rank
from jaxbrdf.core.ranges import SHARE, Range
from jaxbrdf.core.smith import lift
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine
from jaxbrdf.types import Brdf, Query, Sample


class SubstrateParams(NamedTuple):
    """albedo: of the body, for R, G and B. eta: refractive index of its surface."""

    albedo: Annotated[jax.Array, SHARE]
    eta: Annotated[jax.Array, Range(1.0, 1e3)]


def _reflectance(params: SubstrateParams, query: Query) -> jax.Array:
    """pi f, whatever the horizon."""
    into = facet_transmittance(cos_theta(lift(query.wi)), params.eta)
    out_of = facet_transmittance(cos_theta(lift(query.wo)), params.eta)
    albedo = match_rank(params.albedo, query.wo.ndim)
    escape = (1.0 - diffuse_reflectance(params.eta)) / (params.eta * params.eta)
    # 1 - R_in albedo in parts: of a dense white body nothing else is left of the difference
    lost = (1.0 - albedo) + match_rank(escape[..., None], query.wo.ndim) * albedo
    passed = into * out_of / (params.eta * params.eta)
    return passed[..., None] * albedo / lost


def _eval(params: SubstrateParams, query: Query) -> jax.Array:
    lit = above_horizon(query.wi, query.wo)[..., None]
    return jnp.where(lit, _reflectance(params, query) / jnp.pi, 0.0)


def _sample(params: SubstrateParams, query: Query, u: jax.Array) -> Sample:
    wi = square_to_cosine(u[..., 1:])
    lit = above_horizon(wi, query.wo)
    weight = jnp.where(lit[..., None], _reflectance(params, Query(wi, query.wo)), 0.0)
    return Sample(wi, jnp.where(lit, cosine_density(wi), 0.0), weight)


def _pdf(params: SubstrateParams, query: Query) -> jax.Array:
    return jnp.where(above_horizon(query.wi, query.wo), cosine_density(query.wi), 0.0)


SUBSTRATE = within_ranges(Brdf(_eval, _sample, _pdf))
