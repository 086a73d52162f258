"""Sheen of fibres that stand on the surface: the "Charlie" distribution of Estevez and Kulla (2017).

    f = colour D(wh) / (4 cos_i cos_o (1 + Lambda(cos_i) + Lambda(cos_o))),   D = (2 + 1 / r) sin_h^(1 / r) / (2 pi)

D integrates to one against the cosine. Their fit of Smith's Lambda is exp(L(x)) for cosines x below a half and
exp(2 L(1/2) - L(1 - x)) above, L(x) = a / (1 + b x^c) + d x + e, with the five numbers at roughness 0 and 1 mixed by
(1 - r)^2. Two things differ from the paper:

- its softened terminator, which takes Lambda of the light alone to a power, is left out: it is not reciprocal;
- the fit stays finite at grazing angles, where Smith's Lambda grows as 1 / x and a finite one lets the albedo grow
  without bound. Below x = 1e-3 it is continued as 1 / x.

With these the albedo is at most one for r >= 0.0675 (it is 0.989 at 0.07, and 2.1 at 0.01), which sets the range of r.
What glTF calls sheen roughness is the square root of r.

Parameters: colour, `(3,)` or `(..., 3)`, in [0, 1]; roughness r, `()` or `(...)`, in [0.07, 1].
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.directions import above_horizon, cos_theta
from jaxbrdf.core.numerics import match_rank, safe_divide, safe_sqrt, sum_of_squares
from jaxbrdf.core.ranges import SHARE, Range
from jaxbrdf.core.smith import lift
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.types import Query

SMOOTH = (25.3245, 3.32435, 0.16801, -1.27393, -4.85967)
ROUGH = (21.5473, 3.82987, 0.19823, -1.97760, -4.32054)
"""a, b, c, d, e of L at roughness 0 and 1 (Estevez and Kulla 2017)."""

LEAST_COSINE = 1e-3
"""From where on towards grazing Lambda is continued as 1 / cosine."""

LEAST_ROUGHNESS = 0.07

ALBEDO = (
    (-0.8631, -1.23055, -0.50076, -0.12022, -0.11468, -0.34326, -0.29959),
    (0.01187, -0.89852, -0.54271, -0.11402, -0.21884, -0.54324, -0.33543),
    (-0.06652, -0.30107, -0.20707, -0.13202, -0.13811, -0.11563, -0.04717),
    (-0.03186, -0.0302, -0.03801, -0.07231, -0.01837, 0.09596, 0.06686),
)
"""Of log(albedo (cos + area(cos))): powers of 2 sqrt(cos) - 1 along a row, of 2 log r / log 0.07 - 1 from row to row.

By experiments/derive_sheen_albedo.py; largest error of the albedo 1.7e-3.
"""


class SheenParams(NamedTuple):
    """colour: reflectance of a fibre, for R, G and B. roughness: how far the fibres lie from upright."""

    colour: Annotated[jax.Array, SHARE]
    roughness: Annotated[jax.Array, Range(LEAST_ROUGHNESS, 1.0)]


def _eval(params: SheenParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    both, r = wi + wo, params.roughness
    sin_squared = safe_divide(sum_of_squares(both[..., :2]), sum_of_squares(both))
    usable = sin_squared > 0
    # sin^(1 / r) is zero at the normal, and so are its slopes but for r = 1, where it has none
    power = jnp.exp(jnp.log(jnp.where(usable, sin_squared, 1.0)) / (2.0 * r))
    density = (2.0 + 1.0 / r) / (2.0 * jnp.pi) * jnp.where(usable, power, 0.0)
    f = match_rank(params.colour, query.wi.ndim) * (density * _visibility(wi, wo, r))[..., None]
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _visibility(wi: jax.Array, wo: jax.Array, r: jax.Array) -> jax.Array:
    """G2 / (4 cos_i cos_o), with area(x) = x Lambda(x) in place of Lambda."""
    cos_i, cos_o = cos_theta(wi), cos_theta(wo)
    return 0.25 / (cos_i * cos_o + _area(cos_i, r) * cos_o + _area(cos_o, r) * cos_i)


def _area(cos: jax.Array, r: jax.Array) -> jax.Array:
    """cos Lambda(cos), constant below `LEAST_COSINE`."""
    x = jnp.clip(cos, LEAST_COSINE, 1.0)
    upper = x > 0.5
    # at least epsilon: the slope of a root of zero is infinite
    near = _log_lambda(jnp.maximum(jnp.where(upper, 1.0 - x, x), jnp.finfo(x.dtype).eps), r)
    return x * jnp.exp(jnp.where(upper, 2.0 * _log_lambda(jnp.full_like(x, 0.5), r) - near, near))


def _log_lambda(x: jax.Array, r: jax.Array) -> jax.Array:
    """L(x)."""
    smooth = (1.0 - r) * (1.0 - r)
    a, b, c, d, e = (one * smooth + other * (1.0 - smooth) for one, other in zip(SMOOTH, ROUGH, strict=True))
    return a / (1.0 + b * x**c) + d * x + e


def _albedo(params: SheenParams, query: Query) -> jax.Array:
    cos, r = jnp.minimum(cos_theta(lift(query.wo)), 1.0), params.roughness
    x = 2.0 * jnp.sqrt(cos) - 1.0
    y = 2.0 * jnp.log(r) / np.log(LEAST_ROUGHNESS) - 1.0
    grey = jnp.exp(_horner([_horner(list(row), x) for row in ALBEDO], y)) / (cos + _area(cos, r))
    lit = cos_theta(query.wo)[..., None] > 0
    return jnp.where(lit, match_rank(params.colour, query.wo.ndim) * grey[..., None], 0.0)


def _horner(coefficients: list, x: jax.Array) -> jax.Array:
    """The polynomial with these coefficients, lowest power first."""
    value = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value


def _draw(params: SheenParams, wo: jax.Array, u: jax.Array) -> jax.Array:
    """Light of density in proportion to (1 - cos)^n: uniform for n = 0, ever nearer to the horizon as n grows."""
    del wo
    below = u[..., 1] ** (1.0 / (1.0 + _lean(params)))
    sin, phi = safe_sqrt(below * (2.0 - below)), 2.0 * jnp.pi * u[..., 2]
    return jnp.stack([sin * jnp.cos(phi), sin * jnp.sin(phi), 1.0 - below], axis=-1)


def _density(params: SheenParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    # 1 - cos by the sine, which keeps its digits near the normal
    below = sum_of_squares(wi[..., :2]) / (1.0 + jnp.maximum(cos_theta(wi), 0.0))
    n = _lean(params)
    density = (1.0 + n) / (2.0 * jnp.pi) * jnp.exp(n * jnp.log(jnp.maximum(below, jnp.finfo(wi.dtype).tiny)))
    return jnp.where(above_horizon(wi, wo), density, 0.0)


def _lean(params: SheenParams) -> jax.Array:
    """n = 0.1 / r. Of eight multiples from 0 to 0.25 its draws' variance over their squared mean is least.

    It is 0.42 on the mean of five roughnesses and six views, 0.63 for uniform draws and 2.8 for the cosine's.
    """
    return 0.1 / params.roughness


_SAMPLED = sampled_by(Proposal(_draw, _density), _eval, lambda params: Proposed(params, params))
SHEEN = within_ranges(_SAMPLED._replace(albedo=_albedo))
