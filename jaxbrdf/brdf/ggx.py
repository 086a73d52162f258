"""Rough reflection off anisotropic GGX microfacets.

f = D(wh) F(wi . wh) G2(wi, wo) / (4 cos_i cos_o) (Walter et al. 2007, Eq. 20), with Smith's height-correlated G2
(Heitz 2014, Eq. 99) and visible normals as the sampler. Single scattering: rough lobes lose energy.

Parameters: alpha_x, alpha_y, roughness along tangent and bitangent, `()` or the batch shape, in [1e-4, 1]; fresnel, a
`Schlick`, `Dielectric` or `Conductor` record of `jaxbrdf.core.fresnel`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import above_horizon, cos_theta, dot, reflect
from jaxbrdf.core.fresnel import Fresnel
from jaxbrdf.core.microfacet import (
    ggx_density,
    lift,
    reflected_density,
    sample_visible_normal,
    stretched_length,
    visibility,
)
from jaxbrdf.core.numerics import safe_divide, safe_norm, safe_normalize
from jaxbrdf.types import Brdf, Query, Sample


class GgxParams(NamedTuple):
    """Roughness along x and y, and the interface that each microfacet is."""

    alpha_x: jax.Array
    alpha_y: jax.Array
    fresnel: Fresnel


def _eval(params: GgxParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    both = wi + wo
    wh = safe_normalize(both)
    # wi . wh = |wi + wo| / 2 for unit vectors, and the length does not cancel where the two are opposed.
    cos_d = jnp.minimum(0.5 * safe_norm(both), 1.0)
    lobe = ggx_density(wh, params.alpha_x, params.alpha_y) * visibility(wi, wo, params.alpha_x, params.alpha_y)
    f = lobe[..., None] * params.fresnel.reflectance(cos_d)
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _pdf(params: GgxParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    density = reflected_density(safe_normalize(wi + wo), wo, params.alpha_x, params.alpha_y)
    return jnp.where(above_horizon(query.wi, query.wo), density, 0.0)


def _sample(params: GgxParams, query: Query, u: jax.Array) -> Sample:
    wo = lift(query.wo)
    wh = sample_visible_normal(wo, params.alpha_x, params.alpha_y, u[..., 1:])
    wi = reflect(wo, wh)
    lit = above_horizon(wi, query.wo)
    density = jnp.where(lit, reflected_density(wh, wo, params.alpha_x, params.alpha_y), 0.0)
    cos_d = jnp.clip(dot(wo, wh), 0.0, 1.0)
    weight = _shadowing_given_masking(params, lift(wi), wo)[..., None] * params.fresnel.reflectance(cos_d)
    return Sample(wi, density, jnp.where(lit[..., None], weight, 0.0))


def _shadowing_given_masking(params: GgxParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """G2 / G1(wo) = cos_i (cos_o + s_o) / (s_i cos_o + s_o cos_i): what is left of f cos / pdf beside Fresnel."""
    s_i = stretched_length(wi, params.alpha_x, params.alpha_y)
    s_o = stretched_length(wo, params.alpha_x, params.alpha_y)
    cos_i, cos_o = cos_theta(wi), cos_theta(wo)
    return safe_divide(cos_i * (cos_o + s_o), s_i * cos_o + s_o * cos_i)


GGX = Brdf(_eval, _sample, _pdf)
