"""Rough diffuse reflection that keeps its energy: the EON model of Portsmouth, Kutz and Hill (2025).

    f = albedo A (1 + r s / t) / pi + f_ms,   A = 1 / (1 + c1 r),   c1 = 1 / 2 - 2 / (3 pi)

is the single scattering of Fujii's form of Oren and Nayar (1994), with s = wi . wo - cos_i cos_o and t = 1 where s < 0,
the larger cosine elsewhere. What it loses of white light, 1 - E(cos) = A r H(cos), comes back as

    f_ms = albedo_ms / pi (1 - E_i) (1 - E_o) / (1 - mean E),   1 - mean E = A r (c1 - c2),   c2 = 2 / 3 - 28 / (15 pi)
    albedo_ms = albedo^2 mean E / (1 - albedo (1 - mean E)).

r cancels once and f is Lambert's at r = 0. Reciprocal; a white body reflects everything.

Parameters: albedo, `(3,)` or `(..., 3)`; roughness r, `()` or `(...)`; both in [0, 1].
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.directions import above_horizon, cos_theta, sin_theta
from jaxbrdf.core.numerics import match_rank, safe_divide, sum_of_squares
from jaxbrdf.core.ranges import SHARE
from jaxbrdf.core.smith import lift
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.types import Query

C1 = 0.5 - 2.0 / (3.0 * np.pi)
C2 = 2.0 / 3.0 - 28.0 / (15.0 * np.pi)


class OrenNayarParams(NamedTuple):
    """albedo: share that each scattering keeps, for R, G and B. roughness: 0 is Lambert, 1 the roughest."""

    albedo: Annotated[jax.Array, SHARE]
    roughness: Annotated[jax.Array, SHARE]


def _eval(params: OrenNayarParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    albedo = match_rank(params.albedo, query.wi.ndim)
    again = _scale(params) * params.roughness * _loss(wi) * _loss(wo) / (C1 - C2)
    f = (albedo * _single(params, wi, wo)[..., None] + _albedo_again(params, albedo) * again[..., None]) / jnp.pi
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _single(params: OrenNayarParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """A (1 + r s / t), pi times single scattering at albedo one, without cancellation.

    s is the inner product of the tangential parts. Towards opposed directions it nears -1, and 1 + s is written as half
    of |tangential sum|^2 + cos_i^2 + cos_o^2, which is the same for unit vectors.
    """
    s = wi[..., 0] * wo[..., 0] + wi[..., 1] * wo[..., 1]
    cos_i, cos_o = cos_theta(wi), cos_theta(wo)
    forward = 0.5 * (sum_of_squares(wi[..., :2] + wo[..., :2]) + cos_i * cos_i + cos_o * cos_o)
    r = params.roughness
    shape = jnp.where(s > 0, 1.0 + r * s / jnp.maximum(cos_i, cos_o), (1.0 - r) + r * forward)
    return _scale(params) * shape


def _scale(params: OrenNayarParams) -> jax.Array:
    """A."""
    return 1.0 / (1.0 + C1 * params.roughness)


def _loss(w: jax.Array) -> jax.Array:
    """H = (1 - E) / (A r), what single scattering loses of white light: zero at grazing, c1 at normal incidence.

    E's closed form (Portsmouth et al. 2025, from Fujii's integral) divides by the cosine and subtracts it from one.
    Here acos is the complement of an asin and 1 - sin is cos^2 / (1 + sin): every term vanishes with the cosine, as H
    does.
    """
    cos, sin = cos_theta(w), sin_theta(w)
    steep = cos * cos / (1.0 + sin)
    ring = (2.0 / 3.0) * sin * (1.0 + sin + sin * sin) / (1.0 + sin)
    return ((0.5 * jnp.pi - 2.0 / 3.0) * steep + sin * jnp.arctan2(cos, sin) + cos * (sin * sin - ring)) / jnp.pi


def _albedo_again(params: OrenNayarParams, albedo: jax.Array) -> jax.Array:
    """albedo_ms, `(..., 3)`."""
    kept = match_rank((_scale(params) * (1.0 + C2 * params.roughness))[..., None], albedo.ndim)
    return albedo * albedo * kept / ((1.0 - albedo) + albedo * kept)


def _albedo(params: OrenNayarParams, query: Query) -> jax.Array:
    lost = (_scale(params) * params.roughness * _loss(lift(query.wo)))[..., None]
    albedo = match_rank(params.albedo, query.wo.ndim)
    total = albedo * (1.0 - lost) + _albedo_again(params, albedo) * lost
    return jnp.where(cos_theta(query.wo)[..., None] > 0, total, 0.0)


def _density(params: OrenNayarParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    side = _side(wo)
    along = side[..., 0] * wi[..., 0] + side[..., 1] * wi[..., 1]
    folded = jnp.maximum(along, 0.0) * (2.0 / jnp.pi)
    return jnp.where(above_horizon(wi, wo), blend(_chances(params, wo), [cosine_density(wi), folded]), 0.0)


def _draw(params: OrenNayarParams, wo: jax.Array, u: jax.Array) -> jax.Array:
    side = _side(wo)

    def folded(u: jax.Array) -> jax.Array:
        w = square_to_cosine(u[..., 1:])
        x, y, z = w[..., 2], w[..., 0], jnp.abs(w[..., 1])
        return jnp.stack([side[..., 0] * x - side[..., 1] * y, side[..., 1] * x + side[..., 0] * y, z], axis=-1)

    return choose(_chances(params, wo), [lambda u: square_to_cosine(u[..., 1:]), folded], u)


def _chances(params: OrenNayarParams, wo: jax.Array) -> jax.Array:
    """Of a cosine lobe and of one about wo's tangential direction, folded up: `(..., 2)`, up to a common factor.

    Seen from grazing angles f cos is in proportion to cos_i + r max(s, 0), a sum of the two in which the second has
    r / 2 of the first's mass. Towards the normal that falls; sin^2 / sqrt(1 + cos) follows it.
    """
    sin = sin_theta(wo)
    mass = 0.5 * params.roughness * sin * sin / jnp.sqrt(1.0 + jnp.maximum(cos_theta(wo), 0.0))
    return jnp.stack([jnp.ones_like(mass), mass], axis=-1)


def _side(wo: jax.Array) -> jax.Array:
    """Tangential direction of wo, `(..., 2)`; x at the normal, where it is not needed."""
    sin = sin_theta(wo)
    x = jnp.where(sin > 0, safe_divide(wo[..., 0], sin), 1.0)
    return jnp.stack([x, safe_divide(wo[..., 1], sin)], axis=-1)


_SAMPLED = sampled_by(Proposal(_draw, _density), _eval, lambda params: Proposed(params, params))
OREN_NAYAR = within_ranges(_SAMPLED._replace(albedo=_albedo))
