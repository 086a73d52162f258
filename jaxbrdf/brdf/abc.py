"""Glossy reflection with the ABC distribution of microfacets (Low, Kronander, Ynnerman and Unger 2012).

    f = diffuse / pi + F(cos_d) S(1 - cos_h) G / (pi cos_i cos_o),   S(t) = a / (1 + b t)^c

with Fresnel's F of a dielectric, cos_h between half vector and normal, cos_d between half vector and light, and Cook
and Torrance's (1982) G = min(1, 2 cos_h cos_i / cos_d, 2 cos_h cos_o / cos_d). The paper writes S of sqrt(t). S is not
normalised, and nothing bounds the energy: a fit must.

Parameters, with the authors' fits to the 100 materials of MERL in brackets: diffuse, `(3,)` or `(..., 3)`, [0 to 0.41];
a, the same shape, [0.08 to 5710]; log_b, the natural logarithm of b, [2.4 to 15.9]; c, [0.02 to 2.7]; eta, the
refractive index, [1.04 to 100]; all `()` or `(...)`.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.directions import above_horizon, cos_theta, reflect
from jaxbrdf.core.fresnel import dielectric
from jaxbrdf.core.numerics import match_rank, safe_divide, safe_norm, safe_normalize, safe_sqrt, sum_of_squares
from jaxbrdf.core.power_law import power_draw, power_mass
from jaxbrdf.core.ranges import SHARE, Range
from jaxbrdf.core.smith import lift
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.types import Query

LEAST_CHANCE = 0.1
"""Of either lobe: a draw weighs at most ten times what it would if its lobe were the only one."""


class AbcParams(NamedTuple):
    """Diffuse share and height of the peak for R, G and B; log b and c, width and fall-off; refractive index."""

    diffuse: Annotated[jax.Array, SHARE]
    a: Annotated[jax.Array, Range(0.0, 1e5)]
    log_b: Annotated[jax.Array, Range(-4.0, 17.0)]
    c: Annotated[jax.Array, Range(0.01, 10.0)]
    eta: Annotated[jax.Array, Range(1.0, 1e3)]


def _eval(params: AbcParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    both = wi + wo
    # wi . wh = |wi + wo| / 2 for unit vectors, and the length does not cancel where the two are opposed
    fresnel = dielectric(jnp.minimum(0.5 * safe_norm(both), 1.0), params.eta)
    lobe = fresnel * jnp.exp(_log_fall(params, safe_normalize(both))) * _masking(wi, wo)
    rank = query.wi.ndim
    f = (match_rank(params.diffuse, rank) + match_rank(params.a, rank) * lobe[..., None]) / jnp.pi
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _log_fall(params: AbcParams, wh: jax.Array) -> jax.Array:
    """log (1 + b t)^-c, with t = 1 - cos_h = sin_h^2 / (1 + cos_h), which keeps its digits at the peak."""
    t = sum_of_squares(wh[..., :2]) / (1.0 + cos_theta(wh))
    return -params.c * jnp.log1p(jnp.exp(params.log_b) * t)


def _masking(wi: jax.Array, wo: jax.Array) -> jax.Array:
    """G / (cos_i cos_o) = min(1 / (cos_i cos_o), 4 (1 + smaller / larger cosine) / |wi + wo|^2).

    2 cos_h / cos_d is 4 (cos_i + cos_o) / |wi + wo|^2, and of G's last two terms that with the smaller cosine counts.
    """
    cos_i, cos_o = cos_theta(wi), cos_theta(wo)
    ratio = jnp.minimum(cos_i, cos_o) / jnp.maximum(cos_i, cos_o)
    return jnp.minimum(1.0 / (cos_i * cos_o), safe_divide(4.0 * (1.0 + ratio), sum_of_squares(wi + wo)))


def _density(params: AbcParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    density = blend(_chances(params, wo), [cosine_density(wi), _glossy_density(params, lift(wi) + lift(wo))])
    return jnp.where(above_horizon(wi, wo), density, 0.0)


def _glossy_density(params: AbcParams, both: jax.Array) -> jax.Array:
    """b (1 + b t)^-c / (2 pi mass) per solid angle of the half vector, over 4 cos_d = 2 |wi + wo| for that of wi."""
    mass = power_mass(jnp.log1p(jnp.exp(params.log_b)), params.c)
    radial = jnp.exp(_log_fall(params, safe_normalize(both)) + params.log_b) / (2.0 * jnp.pi * mass)
    return safe_divide(radial, 2.0 * safe_norm(both))


def _draw(params: AbcParams, wo: jax.Array, u: jax.Array) -> jax.Array:
    draws = [lambda u: square_to_cosine(u[..., 1:]), lambda u: reflect(wo, _half_vector(params, u[..., 1:]))]
    return choose(_chances(params, wo), draws, u)


def _half_vector(params: AbcParams, u: jax.Array) -> jax.Array:
    """A half vector whose t has the density (1 + b t)^-c up to a factor: 1 + b t is a power law's draw."""
    log_y = power_draw(jnp.log1p(jnp.exp(params.log_b)), params.c, u[..., 0])
    t = jnp.minimum(jnp.expm1(log_y) * jnp.exp(-params.log_b), 1.0)
    sin, phi = safe_sqrt(t * (2.0 - t)), 2.0 * jnp.pi * u[..., 1]
    return jnp.stack([sin * jnp.cos(phi), sin * jnp.sin(phi), 1.0 - t], axis=-1)


def _chances(params: AbcParams, wo: jax.Array) -> jax.Array:
    """Of the cosine and the glossy lobe, `(..., 2)`, by their shares of the albedo, roughly.

    With d wi = 4 cos_d d wh a narrow lobe seen from near the normal reflects 4 F(cos_o) / pi times the integral of S,
    which is 2 pi a mass / b.
    """
    mass = power_mass(jnp.log1p(jnp.exp(params.log_b)), params.c) * jnp.exp(-params.log_b)
    fresnel = dielectric(jnp.clip(cos_theta(wo), 0.0, 1.0), params.eta)
    glossy = 8.0 * fresnel * mass * jnp.mean(params.a, axis=-1)
    share = jnp.clip(safe_divide(glossy, glossy + jnp.mean(params.diffuse, axis=-1)), LEAST_CHANCE, 1.0 - LEAST_CHANCE)
    return jnp.stack([1.0 - share, share], axis=-1)


ABC = within_ranges(sampled_by(Proposal(_draw, _density), _eval, lambda params: Proposed(params, params)))
