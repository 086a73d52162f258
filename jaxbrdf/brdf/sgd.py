"""Glossy reflection with shifted gamma microfacets (Bagher, Soler and Holzschuch 2012), all of it for each channel.

    f = (diffuse + specular F(cos_d) D(wh) G1(wi) G1(wo) / (cos_i cos_o)) / pi

    F(c)  = f0 - f1 c + (1 - f0) (1 - c)^5, cut at zero
    D(wh) = K exp(-x) x^-p / (pi cos_h^4),   x = alpha + tan_h^2 / alpha
    G1(w) = 1 - lambda (exp(c max(theta - theta0, 0)^k) - 1), cut at zero

D integrates to one against the cosine: with q = tan^2, D cos_h d wh = K exp(-x) x^-p dq d phi / (2 pi), so that

    K = 1 / (alpha Gamma(1 - p, alpha)),   Gamma(1 - p, alpha) = integral of x^-p exp(-x) over x > alpha.

It is computed from alpha and p. The authors' table stores it, and agrees to its six digits but for one material.

Their c spans 45 powers of ten, for it only counts times a power with k in the hundreds. The parameter here is the
logarithm of the two at the horizon, growth = c (pi / 2 - theta0)^k, which is of order one wherever there is shadowing:
it suits a fit, and keeps its digits in float32. Reciprocal; nothing bounds the energy: a fit must.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.directions import above_horizon, cos_theta, reflect, sin_theta
from jaxbrdf.core.numerics import match_rank, safe_divide, safe_norm, sum_of_squares
from jaxbrdf.core.power_law import power_draw, power_mass
from jaxbrdf.core.ranges import SHARE, Range, clamp
from jaxbrdf.core.smith import lift
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.types import Query

TERMS = 18
"""Of the exponential's series on [0, 1]: the first that is left out is below 1 / 18!, 2e-16."""

LAGUERRE = np.polynomial.laguerre.laggauss(40)
"""Nodes and weights for the integral of exp(-y) (1 + y)^-p over y > 0: error below 5e-9 for p in [0, 2]."""

SATURATED = 40.0
"""Exponent at which shadowing is complete for every valid lambda: exp(-18) (exp(40) - 1) is above one."""

LEAST_COSINE = 2e-5
"""To which cosines are raised: f is at most 1e11 / cos^2 (alpha 1e-5, p = 2), and its derivative by tan_h^2 and that
of tan_h^2 are another 1 / alpha and 1 / (2 cos)^2, in all 2e34 here; float32 ends at 3e38."""

LEAST_CHANCE = 0.1
"""Of the cosine, and of all glossy lobes together: a draw weighs at most ten times what it would otherwise."""


class SgdParams(NamedTuple):
    """All `(3,)` or `(..., 3)`, for R, G and B.

    Attributes:
        diffuse: rho_d.
        specular: rho_s.
        alpha, p: width and fall-off of the distribution.
        f0, f1: of Fresnel's term, which is f0 - f1 at normal and one at grazing incidence.
        log_lambda, log_growth: natural logarithms of lambda and of c (pi / 2 - theta0)^k.
        k: exponent of the shadowing.
        theta0: angle from which on there is any, in radians.
    """

    diffuse: Annotated[jax.Array, SHARE]
    specular: Annotated[jax.Array, Range(0.0, 10.0)]
    alpha: Annotated[jax.Array, Range(1e-5, 1.0)]
    p: Annotated[jax.Array, Range(0.0, 2.0)]
    f0: Annotated[jax.Array, Range(0.0, 10.0)]
    f1: Annotated[jax.Array, Range(-1.0, 10.0)]
    log_lambda: Annotated[jax.Array, Range(-18.0, 18.0)]
    log_growth: Annotated[jax.Array, Range(-30.0, 4.0)]
    k: Annotated[jax.Array, Range(1.0, 1e3)]
    theta0: Annotated[jax.Array, Range(-1.0, 1.5)]


def published(columns: Sequence[Sequence[float]]) -> SgdParams:
    """A row of the authors' table: rho_d, rho_s, alpha, p, f0, f1, K, lambda, c, k, theta0, each for R, G and B.

    K is not read. What lies outside of a range, such as a growth of exp(-97), is put to its end, with the same f.
    """
    diffuse, specular, alpha, p, f0, f1, _, scale, c, k, theta0 = np.asarray(columns, np.float64)
    log_growth = np.log(c) + k * np.log(0.5 * np.pi - theta0)
    params = SgdParams(diffuse, specular, alpha, p, f0, f1, np.log(scale), log_growth, k, theta0)
    return clamp(SgdParams(*(jnp.asarray(values, jnp.float32) for values in params)))


def _eval(params: SgdParams, query: Query) -> jax.Array:
    wi, wo = _raised(query.wi), _raised(query.wo)
    own = _lifted(params, query.wi.ndim)
    log_d = -jnp.log(own.alpha * _gamma(own)) + _log_gloss(own, wi + wo)
    visible = _unshadowed(own, wi) * _unshadowed(own, wo) / (cos_theta(wi) * cos_theta(wo))[..., None]
    glossy = own.specular * _fresnel(own, wi, wo) * jnp.exp(log_d) * visible / jnp.pi
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], (own.diffuse + glossy) / jnp.pi, 0.0)


def _raised(w: jax.Array) -> jax.Array:
    return jnp.concatenate([w[..., :2], jnp.maximum(w[..., 2:], LEAST_COSINE)], axis=-1)


def _lifted(params: SgdParams, rank: int) -> SgdParams:
    return SgdParams(*(match_rank(field, rank) for field in params))


def _log_gloss(own: SgdParams, both: jax.Array) -> jax.Array:
    """log (exp(-x) x^-p / cos_h^4) for wi + wo; 1 / cos_h^2 is 1 + tan_h^2.

    In the logarithm, since towards the horizon 1 / cos_h^4 overflows where exp(-x) is long zero.
    """
    tan_squared = _tan_squared(both)[..., None]
    x = own.alpha + tan_squared / own.alpha
    return -x - own.p * jnp.log(x) + 2.0 * jnp.log1p(tan_squared)


def _tan_squared(both: jax.Array) -> jax.Array:
    # the quotients first: backwards a cotangent over z^4 would overflow before it meets a zero
    return sum_of_squares(both[..., :2] / both[..., 2:])


def _gamma(own: SgdParams) -> jax.Array:
    """Gamma(1 - p, alpha) for alpha in (0, 1].

    From alpha to one term by term, the integral of x^(n - p) being alpha^(n + 1 - p) times a power law's mass, smooth
    where n + 1 = p; from one on by Gauss and Laguerre.
    """
    log_width = -jnp.log(own.alpha)
    inner = jnp.zeros_like(own.alpha * own.p)
    for n in range(TERMS):
        # with x = exp(-s) the integrand is exp((p - n - 1) s) ds, a power law of exp(s)
        inner = inner + (-1.0) ** n / math.factorial(n) * power_mass(log_width, (n + 2.0) - own.p)
    nodes, weights = (jnp.asarray(values, own.p.dtype) for values in LAGUERRE)
    rank = own.p.ndim + 1
    falls = jnp.exp(-own.p[..., None] * match_rank(jnp.log1p(nodes), rank))
    return inner + math.exp(-1.0) * jnp.sum(match_rank(weights, rank) * falls, axis=-1)


def _fresnel(own: SgdParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """F in powers of 1 - cos_d = |wi - wo|^2 / (4 (1 + cos_d)), for f0 and f1 may nearly be one another."""
    cos = jnp.minimum(0.5 * safe_norm(wi + wo), 1.0)
    return _fresnel_of(own, 0.25 * sum_of_squares(wi - wo) / (1.0 + cos))


def _fresnel_of(own: SgdParams, grazing: jax.Array) -> jax.Array:
    g = jnp.minimum(grazing, 1.0)[..., None]
    square = g * g
    return jnp.maximum((own.f0 - own.f1) + own.f1 * g + (1.0 - own.f0) * square * square * g, 0.0)


def _unshadowed(own: SgdParams, w: jax.Array) -> jax.Array:
    """G1, `(..., 3)`.

    The angle beyond theta0 as a share of the widest is 1 - elevation / widest: near the horizon, where shadowing is
    strongest, the elevation has more digits than theta.
    """
    elevation = jnp.arctan2(cos_theta(w), sin_theta(w))[..., None]
    widest = 0.5 * jnp.pi - own.theta0
    inside = elevation < widest
    log_share = jnp.log1p(-jnp.where(inside, elevation / widest, 0.0))
    growth = jnp.exp(jnp.minimum(own.log_growth + own.k * log_share, math.log(SATURATED)))
    return jnp.where(inside, jnp.maximum(1.0 - jnp.exp(own.log_lambda) * jnp.expm1(growth), 0.0), 1.0)


def _draw(params: SgdParams, wo: jax.Array, u: jax.Array) -> jax.Array:
    own = _lifted(params, wo.ndim)

    def mirrored(channel: int) -> Callable[[jax.Array], jax.Array]:
        return lambda u: reflect(wo, _half_vector(own.alpha[..., channel], own.p[..., channel], u[..., 1:]))

    return choose(_chances(own, wo), [lambda u: square_to_cosine(u[..., 1:]), *map(mirrored, range(3))], u)


def _density(params: SgdParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    own = _lifted(params, wo.ndim)
    glossy = _glossy_density(own, lift(wi) + lift(wo))
    density = blend(_chances(own, wo), [cosine_density(wi), *jnp.moveaxis(glossy, -1, 0)])
    return jnp.where(above_horizon(wi, wo), density, 0.0)


def _half_vector(alpha: jax.Array, p: jax.Array, u: jax.Array) -> jax.Array:
    """A half vector whose x has a density in proportion to x^-p up to one and to exp(-x) from there on.

    That is D cos_h without a factor that lies in [1 / e, 1] below one and is x^-p above.
    """
    width = -jnp.log(alpha)
    inner, whole = _envelope_masses(alpha, p)
    share = u[..., 0] * whole
    power = alpha * jnp.expm1(power_draw(width, p, jnp.clip(safe_divide(share, inner), 0.0, 1.0)))
    tail = jnp.clip((share - inner) * math.e, 0.0, 1.0 - jnp.finfo(u.dtype).epsneg)
    tan = jnp.sqrt(alpha * jnp.where(share < inner, power, (1.0 - alpha) - jnp.log1p(-tail)))
    cos, phi = 1.0 / jnp.sqrt(1.0 + tan * tan), 2.0 * jnp.pi * u[..., 1]
    return jnp.stack([tan * cos * jnp.cos(phi), tan * cos * jnp.sin(phi), cos], axis=-1)


def _envelope_masses(alpha: jax.Array, p: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Integral of x^-p from alpha to one, and the same with that of exp(-x) from one on."""
    inner = power_mass(-jnp.log(alpha), 2.0 - p)
    return inner, inner + math.exp(-1.0)


def _glossy_density(own: SgdParams, both: jax.Array) -> jax.Array:
    """Of `_half_vector` mirrored, per channel: g(x) / (whole pi alpha cos_h^3) over 4 cos_d = 2 |wi + wo|."""
    tan_squared = _tan_squared(both)[..., None]
    x = own.alpha + tan_squared / own.alpha
    log_g = jnp.where(x < 1.0, -own.p * jnp.log(x), -x) + 1.5 * jnp.log1p(tan_squared)
    whole = _envelope_masses(own.alpha, own.p)[1]
    return safe_divide(jnp.exp(log_g) / (jnp.pi * own.alpha * whole), 2.0 * safe_norm(both)[..., None])


def _chances(own: SgdParams, wo: jax.Array) -> jax.Array:
    """Of the cosine and each channel's lobe, `(..., 4)`, by their shares of the albedo, roughly.

    With d wi = 4 cos_d d wh a narrow lobe seen from near the normal reflects 4 specular F(cos_o) / pi.
    """
    glossy = (4.0 / jnp.pi) * own.specular * _fresnel_of(own, 1.0 - jnp.maximum(cos_theta(wo), 0.0))
    total = jnp.mean(glossy, axis=-1)
    share = safe_divide(total, total + jnp.mean(own.diffuse, axis=-1))
    share = jnp.clip(share, LEAST_CHANCE, 1.0 - LEAST_CHANCE)[..., None]
    each = jnp.where(total[..., None] > 0, safe_divide(glossy, 3.0 * total[..., None]), 1.0 / 3.0)
    return jnp.concatenate([1.0 - share, share * each], axis=-1)


SGD = within_ranges(sampled_by(Proposal(_draw, _density), _eval, lambda params: Proposed(params, params)))
