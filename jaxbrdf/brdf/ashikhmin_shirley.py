"""The anisotropic Phong lobe of Ashikhmin and Shirley (2000), with its exponents given as a roughness.

    f = D(wh) F(wi . wh) / (4 (wi . wh) max(cos_i, cos_o)),   D(wh) = sqrt(det(A^-2 + I)) / (2 pi) cos_h^e,
    e = |A^-1 d|^2 for the azimuth d of wh

(their Eq. 4; by the tensor A, Gauthier et al. 2022, appendix A.3). Exponents s = 1 / alpha^2 give the lobe about
the width of a Beckmann lobe of roughness alpha (Olano and Baker 2010). D integrates to one over half vectors, without
a cosine. No microfacets and no masking: f cos_i over the sampler's density is F cos_i / max(cos_i, cos_o), so that a
directional albedo is never above one, and falls towards grazing angles as light is sent below the horizon.

Parameters: roughness, a record of `jaxbrdf.core.roughness`; fresnel, a record of `jaxbrdf.core.fresnel`.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.core.directions import above_horizon, cos_theta, dot, reflect
from jaxbrdf.core.fresnel import Fresnel
from jaxbrdf.core.numerics import safe_divide, safe_norm, safe_normalize, safe_sqrt, sum_of_squares
from jaxbrdf.core.roughness import Roughness
from jaxbrdf.core.smith import lift
from jaxbrdf.types import Brdf, Query, Sample


class AshikhminShirleyParams(NamedTuple):
    """The lobe's width, and the interface that reflects."""

    roughness: Roughness
    fresnel: Fresnel


def _eval(params: AshikhminShirleyParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    both = wi + wo
    # wi . wh of unit vectors, without cancellation where the two are opposed
    cos_d = jnp.minimum(0.5 * safe_norm(both), 1.0)
    density = _reflected_density(params.roughness, safe_normalize(both), cos_d)
    f = (density / jnp.maximum(cos_theta(wi), cos_theta(wo)))[..., None] * params.fresnel.reflectance(cos_d)
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _pdf(params: AshikhminShirleyParams, query: Query) -> jax.Array:
    both = lift(query.wi) + lift(query.wo)
    density = _reflected_density(params.roughness, safe_normalize(both), jnp.minimum(0.5 * safe_norm(both), 1.0))
    return jnp.where(above_horizon(query.wi, query.wo), density, 0.0)


def _sample(params: AshikhminShirleyParams, query: Query, u: jax.Array) -> Sample:
    wo = lift(query.wo)
    wh = _draw(params.roughness, u[..., 1:])
    wi = reflect(wo, wh)
    # a half vector that faces away from the viewer sends light below the horizon too
    lit = above_horizon(wi, query.wo)
    cos_d = jnp.clip(dot(wo, wh), 0.0, 1.0)
    density = jnp.where(lit, _reflected_density(params.roughness, wh, cos_d), 0.0)
    share = safe_divide(cos_theta(wi), jnp.maximum(cos_theta(wi), cos_theta(wo)))
    weight = share[..., None] * params.fresnel.reflectance(cos_d)
    return Sample(wi, density, jnp.where(lit[..., None], weight, 0.0))


def _reflected_density(roughness: Roughness, wh: jax.Array, cos_d: jax.Array) -> jax.Array:
    """D / (4 wi . wh): density of a direction mirrored about a half vector of density D."""
    squared, determinant = _squared(roughness), roughness.determinant()
    x, y = roughness.shrink(wh[..., 0], wh[..., 1])
    power = jnp.exp((x * x + y * y) * _log_cos_per_squared_sine(wh))
    return safe_divide(power * jnp.sqrt(_plus_identity(squared, determinant)), 8.0 * jnp.pi * determinant * cos_d)


def _log_cos_per_squared_sine(w: jax.Array) -> jax.Array:
    """log(cos) / sin^2, smooth at the normal, where it is -1 / 2.

    Next to the normal its series to the third order in sin^2, where the fourth, sin^8 / 10, is below the dtype's
    epsilon; at wide angles by the cosine, which there is the more exact of the two.
    """
    squared = sum_of_squares(w[..., :2])
    near = squared < jnp.finfo(squared.dtype).eps ** 0.25
    far = squared > 0.5
    small = jnp.where(near, squared, 0.0)
    middle = jnp.where(near | far, 0.25, squared)
    cos = jnp.where(far, jnp.maximum(w[..., 2], jnp.finfo(w.dtype).eps), 0.5)
    series = -0.5 - small * (0.25 + small * (1.0 / 6.0 + 0.125 * small))
    by_sine = 0.5 * jnp.log1p(-middle) / middle
    return jnp.where(near, series, jnp.where(far, jnp.log(cos) / jnp.where(far, squared, 1.0), by_sine))


def _draw(roughness: Roughness, u: jax.Array) -> jax.Array:
    """A half vector `(..., 3)` of density D from u `(..., 2)`.

    At the azimuth d the cosine has the density (e + 1) cos^e, and d itself one in proportion to 1 / (e + 1) =
    1 / (d^T (A^-2 + I) d). So d is g / |g| with g = (A^-2 + I)^(-1/2) c for c uniform on the circle, and |g|^2 is
    1 / (e + 1).
    """
    phi = 2.0 * jnp.pi * u[..., 0]
    x, y = roughness.stretch(*_shortened(roughness, jnp.cos(phi), jnp.sin(phi)))
    log_cos = (x * x + y * y) * jnp.log1p(-u[..., 1])
    sin = safe_sqrt(-jnp.expm1(2.0 * log_cos))
    scale = safe_divide(sin, safe_sqrt(x * x + y * y))
    return jnp.stack([scale * x, scale * y, jnp.exp(log_cos)], axis=-1)


def _shortened(roughness: Roughness, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
    """(I + A^2)^(-1/2) (x, y): with M = I + A^2 and m = sqrt(det M), (adj M + m I) / (m sqrt(tr M + 2 m))."""
    along, across, mixed = _squared(roughness)
    root = jnp.sqrt(_plus_identity((along, across, mixed), roughness.determinant()))
    scale = 1.0 / (root * jnp.sqrt(2.0 + along + across + 2.0 * root))
    own = 1.0 + root
    return scale * ((own + across) * x - mixed * y), scale * ((own + along) * y - mixed * x)


def _squared(roughness: Roughness) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The entries xx, yy and xy of A^2."""
    a, b, c = roughness.tensor()
    return a * a + c * c, b * b + c * c, c * (a + b)


def _plus_identity(squared: tuple[jax.Array, jax.Array, jax.Array], determinant: jax.Array) -> jax.Array:
    """det(A^2 + I) = 1 + tr A^2 + (det A)^2."""
    return 1.0 + squared[0] + squared[1] + determinant * determinant


ASHIKHMIN_SHIRLEY = within_ranges(Brdf(_eval, _sample, _pdf))
