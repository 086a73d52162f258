"""The nine-number proxy of a lobe for one view: a tilted cosine and a leaning GGX lobe (Zeltner et al. 2024, Eqs. 5-9).

The light's density is w_d p_d(wi) + w_s p_s(wi). p_d is a cosine about the normal of a facet with mean slope mu_d.
p_s mirrors the viewer about a normal wh = M m / |M m|, m of the standard surface:

    p_s(wi) = m_z / (pi det M |M^-1 wh|^3) / (4 |wo . wh|),   m = M^-1 wh / |M^-1 wh|,   M = [[A, -mu_s], [0, 1]]

D = 1 / pi of unit roughness is here multiplied by the cosine m_z of the standard space, which the paper's Eq. 7 lacks:
without it p_s integrates to two. A is any root of the covariance of slopes, A A^T = [[ax^2, r ax ay], [r ax ay, ay^2]]:
the standard normals are round, so the paper's triangular root (Eq. 8) and the symmetric one taken here draw the same.

Every m_z is positive and so is every wh_z. Light above the horizon and a viewer above it have a half vector that is
too, and wo . wh > 0, so each wi has this one normal; a normal that faces away from the viewer (wo . wh < 0) mirrors it
to wi_z = 2 (wo . wh) wh_z - wo_z < 0. Such draws are lost with all others below the horizon.

`VISIBLE_PROXY` is a variant with the same numbers whose normals are those that the viewer sees, of density
max(wo . wh, 0) D(wh) / area(wo): fewer draws are lost, and 1 / (wo . wh) is gone from the density.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import above_horizon, half_vector, reflect
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.microsurface import standard_normal, standard_view, surface_normal
from jaxbrdf.core.numerics import safe_divide, safe_norm, safe_normalize, safe_sqrt
from jaxbrdf.core.ranges import SHARE, Range
from jaxbrdf.core.roughness import ROUGHNESS, Tensor
from jaxbrdf.core.smith import lift
from jaxbrdf.sampling.hemisphere import cosine_to_square, square_to_cosine
from jaxbrdf.sampling.mixture import MixtureParams, mixture
from jaxbrdf.sampling.proposal import VISIBLE_NORMALS, Proposal
from jaxbrdf.sampling.tilted_cosine import Tilt, square_to_tilted, tilted_density

SLOPE = Range(-10.0, 10.0)
"""Of mean slopes: 10 is a facet at 84 degrees. Rounding moves a normal by eps |mu|, which a lobe of width alpha sees as
3 eps |mu| / alpha of its density: 2e-4 in float32 for a slope of 1 and alpha = 1e-3."""

CORRELATION = Range(-0.999, 0.999)
"""Of slopes: the thinnest diagonal ellipse is 45 : 1. With t = sqrt(1 - r^2) the determinant of the symmetric root, a
difference of products near 1 / 2, is off by eps / (2 t), a density by four times that: 5e-6 in float32 at t = 0.045."""


class ProxyParams(NamedTuple):
    """The nine numbers, each `()` or of the batch shape.

    Attributes:
        diffuse: w_d, the chance of the cosine up to a common factor with w_s.
        diffuse_slope_x, diffuse_slope_y: mu_d.
        specular: w_s.
        alpha_x, alpha_y: widths of the slopes' distribution along x and y.
        correlation: r of the two.
        slope_x, slope_y: mu_s.
    """

    diffuse: Annotated[jax.Array, SHARE]
    diffuse_slope_x: Annotated[jax.Array, SLOPE]
    diffuse_slope_y: Annotated[jax.Array, SLOPE]
    specular: Annotated[jax.Array, SHARE]
    alpha_x: Annotated[jax.Array, ROUGHNESS]
    alpha_y: Annotated[jax.Array, ROUGHNESS]
    correlation: Annotated[jax.Array, CORRELATION]
    slope_x: Annotated[jax.Array, SLOPE]
    slope_y: Annotated[jax.Array, SLOPE]


def normals_of(params: ProxyParams) -> Ggx:
    """The specular lobe's normals: the symmetric root of the slopes' covariance S, (S + d I) / sqrt(tr S + 2 d).

    d = sqrt(det S) = ax ay sqrt(1 - r^2) (Cayley and Hamilton).
    """
    ax, ay, r = params.alpha_x, params.alpha_y, params.correlation
    d = ax * ay * safe_sqrt((1.0 - r) * (1.0 + r))
    per_trace = 1.0 / jnp.sqrt(ax * ax + ay * ay + 2.0 * d)
    root = Tensor((ax * ax + d) * per_trace, (ay * ay + d) * per_trace, r * ax * ay * per_trace)
    return Ggx(root, jnp.stack(jnp.broadcast_arrays(params.slope_x, params.slope_y), axis=-1))


def tilt_of(params: ProxyParams) -> Tilt:
    """The diffuse lobe's slopes."""
    return Tilt(params.diffuse_slope_x, params.diffuse_slope_y)


def square_to_mirrored(normals: Ggx, wo: jax.Array, u: jax.Array) -> jax.Array:
    """wo mirrored about a normal of density cos D, from u `(..., 2)` (Eq. 9)."""
    return reflect(wo, surface_normal(*normals, square_to_cosine(u)))


def mirrored_to_square(normals: Ggx, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """Inverse of `square_to_mirrored`, for wi below the horizon too: of the two normals the one that is above."""
    h = half_vector(wi, wo)
    upward = jnp.where(h[..., 2:] < 0, -h, h)
    return cosine_to_square(safe_normalize(standard_normal(*normals, upward)))


def mirrored_density(normals: Ggx, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """wh_z D(wh) / (4 wo . wh) for directions above the horizon (Eq. 7 corrected), with wo . wh = |wi + wo| / 2."""
    both = lift(wi) + lift(wo)
    h = safe_normalize(both)
    return safe_divide(normals.density(h) * h[..., 2], 2.0 * safe_norm(both))


def visible_to_square(normals: Ggx, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """The u `(..., 2)` from which `VISIBLE_NORMALS` draws wi: inverse of the spherical cap (Dupuy and Benyoub 2023)."""
    view = safe_normalize(standard_view(*normals, lift(wo)))
    m = safe_normalize(standard_normal(*normals, half_vector(wi, wo)))
    cap = reflect(view, m)
    turn = jnp.arctan2(cap[..., 1], cap[..., 0]) / (2.0 * jnp.pi)
    return jnp.stack([turn - jnp.floor(turn), (1.0 - cap[..., 2]) / (1.0 + view[..., 2])], axis=-1)


def from_unconstrained(x: jax.Array) -> ProxyParams:
    """Valid parameters of any nine numbers, `(..., 9)` in the order of the fields; smooth and rising in each.

    Weights by softmax, roughness logistic in its logarithm, slopes and correlation by tanh. The normals' mean slopes
    count in widths of the lobe, x = mu / alpha for small ones, so that equal steps of any number move a lobe by shares
    of itself.
    """
    diffuse, diffuse_x, diffuse_y, specular, alpha_x, alpha_y, correlation, slope_x, slope_y = jnp.moveaxis(x, -1, 0)
    share = jax.nn.sigmoid(diffuse - specular), jax.nn.sigmoid(specular - diffuse)
    alpha = _to_roughness(alpha_x), _to_roughness(alpha_y)
    return ProxyParams(
        share[0],
        _to_slope(diffuse_x),
        _to_slope(diffuse_y),
        share[1],
        *alpha,
        CORRELATION.high * jnp.tanh(correlation),
        _to_slope(slope_x * alpha[0]),
        _to_slope(slope_y * alpha[1]),
    )


def to_unconstrained(params: ProxyParams) -> jax.Array:
    """Nine numbers `(..., 9)` that `from_unconstrained` turns into `params`: its inverse up to the weights' sum.

    The ends of a range, which no finite number reaches, and a weight of zero are put `EDGE` of the range inside.
    """
    entries = (
        _logarithm(params.diffuse),
        _of_slope(params.diffuse_slope_x),
        _of_slope(params.diffuse_slope_y),
        _logarithm(params.specular),
        _of_roughness(params.alpha_x),
        _of_roughness(params.alpha_y),
        _inverse_tanh(params.correlation / CORRELATION.high),
        _of_slope(params.slope_x) / params.alpha_x,
        _of_slope(params.slope_y) / params.alpha_y,
    )
    return jnp.stack(jnp.broadcast_arrays(*entries), axis=-1)


EDGE = 1e-6
"""Above float32's epsilon, so that 1 - EDGE is not 1; logit and atanh are then at most 14."""


def _to_slope(x: jax.Array) -> jax.Array:
    return SLOPE.high * jnp.tanh(x / SLOPE.high)


def _of_slope(slope: jax.Array) -> jax.Array:
    return SLOPE.high * _inverse_tanh(slope / SLOPE.high)


def _to_roughness(x: jax.Array) -> jax.Array:
    """low^(1 - sigmoid(x)): from low to 1, and not below low by rounding."""
    return jnp.maximum(jnp.exp(jax.nn.sigmoid(-x) * math.log(ROUGHNESS.low)), ROUGHNESS.low)


def _of_roughness(alpha: jax.Array) -> jax.Array:
    share = jnp.clip(jnp.log(alpha) / math.log(ROUGHNESS.low), EDGE, 1.0 - EDGE)
    return jnp.log1p(-share) - jnp.log(share)


def _inverse_tanh(x: jax.Array) -> jax.Array:
    return jnp.arctanh(jnp.clip(x, -1.0 + EDGE, 1.0 - EDGE))


def _logarithm(weight: jax.Array) -> jax.Array:
    return jnp.log(jnp.maximum(weight, EDGE))


def lobes_of(params: ProxyParams) -> MixtureParams:
    """Tilt, normals and chances: what the mixture of `TILTED_COSINE` and a proposal of normals takes."""
    chances = jnp.stack(jnp.broadcast_arrays(params.diffuse, params.specular), axis=-1)
    return MixtureParams((tilt_of(params), normals_of(params)), chances)


def _of_lobes(diffuse: Proposal, specular: Proposal) -> Proposal:
    """The mixture of the two, of `ProxyParams`."""
    lobes = mixture(diffuse, specular)
    return Proposal(
        lambda params, wo, u: lobes.sample(lobes_of(params), wo, u),
        lambda params, wi, wo: lobes.pdf(lobes_of(params), wi, wo),
    )


def _sample_tilted(tilt: Tilt, wo: jax.Array, u: jax.Array) -> jax.Array:
    del wo
    return square_to_tilted(tilt, u[..., 1:])


def _tilted_pdf(tilt: Tilt, wi: jax.Array, wo: jax.Array) -> jax.Array:
    return jnp.where(above_horizon(wi, wo), tilted_density(tilt, wi), 0.0)


def _sample_mirrored(normals: Ggx, wo: jax.Array, u: jax.Array) -> jax.Array:
    return square_to_mirrored(normals, wo, u[..., 1:])


def _mirrored_pdf(normals: Ggx, wi: jax.Array, wo: jax.Array) -> jax.Array:
    return jnp.where(above_horizon(wi, wo), mirrored_density(normals, wi, wo), 0.0)


TILTED_COSINE = Proposal(_sample_tilted, _tilted_pdf)
"""The diffuse lobe; parameters `Tilt`."""

MIRRORED_NORMALS = Proposal(_sample_mirrored, _mirrored_pdf)
"""The viewer mirrored about all normals; parameters `Ggx`."""

PROXY = _of_lobes(TILTED_COSINE, MIRRORED_NORMALS)
"""Zeltner et al.'s; parameters `ProxyParams`."""

VISIBLE_PROXY = _of_lobes(TILTED_COSINE, VISIBLE_NORMALS)
"""The same with visible normals; parameters `ProxyParams`."""
