"""The principled BRDF of Burley (2012, and without transmission 2015): one base colour and shares from 0 to 1.

    f = (1 - metallic) [base / pi (1 + (F90 - 1) Gi) (1 + (F90 - 1) Go) + sheen Gd tint]
        + D F G2 / (4 cos_i cos_o) + clearcoat / 4 Dc Fc Gc

with Gx = (1 - cos_x)^5 and F90 = 1/2 + 2 roughness cos_d^2 (Burley 2012, section 5; the text of 2015 has the same term
in parts). The facets are GGX of alpha = roughness^2, which anisotropic stretches to alpha / aspect and alpha aspect,
aspect^2 = 1 - 0.9 anisotropic. F goes from the exact dielectric to Schlick's curves of the tinted dielectric and of the
metal. Flatness goes from the diffuse term to one after Hanrahan and Krueger (1993). The coat is of GTR1 facets.

Where the two texts leave a choice, this is Mitsuba 3.9's `principled` at spec_trans = 0, in value and density: masking
and shadowing are independent of each other, and the coat's Gc is not divided by 4 cos_i cos_o, as it is in the appendix
of Burley (2012), so a coat is weaker here, by 4 at the normal. Two things differ from the plugin: its facets have an
alpha of 1e-3 at least, here 1e-4, and at eta = 1 it drops the whole specular lobe, the metal's too.

Reciprocal. Not conserving: nothing is taken from the body for what the layers on it reflect, and a white dielectric of
roughness one returns 1.05 of what it gets at the normal and 1.47 at 1.5 radian.

Light is drawn from the cosine, the visible facets and the coat's facets, with the chances 1 - metallic, 1 and
clearcoat / 4 over their sum.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.directions import above_horizon, cos_theta, dot, reflect
from jaxbrdf.core.fresnel import dielectric, schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.numerics import match_rank, safe_divide, safe_norm, safe_normalize, safe_sqrt, sum_of_squares
from jaxbrdf.core.ranges import SHARE, Range
from jaxbrdf.core.roughness import ROUGHNESS, Axes, Isotropic
from jaxbrdf.core.smith import lift, masked_area, separable_visibility
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.sampling.proposal import COSINE, VISIBLE_NORMALS, Proposal
from jaxbrdf.types import Query

LUMINANCE = (0.212671, 0.715160, 0.072169)
"""Of the Rec.709 primaries, to the digits that renderers have; ITU-R BT.709 itself rounds them to four."""

COAT_F0, COAT_MASKING = 0.04, 0.25
"""The coat's reflectance at normal incidence, and the alpha of the GGX facets that mask it, whatever its own."""


class PrincipledParams(NamedTuple):
    """What is None is not there, and costs nothing; each share's neutral value, zero, gives the same f.

    Attributes:
        base_color: of the body, and of the metal at normal incidence, `(3,)` or `(..., 3)`.
        roughness: alpha is its square; this and all others `()` or `(...)`.
        eta: refractive index over that of the outside; of Burley's "specular" by `index_of_specular`.
        metallic: share of metal.
        anisotropic: how far facets stretch along the tangent.
        spec_tint: how far the dielectric's reflection takes the base's hue.
        sheen: light off grazing fibres; a share, no reflectance.
        sheen_tint: how far that takes the base's hue.
        flatness: share of the diffuse light that has scattered beneath the surface.
        clearcoat: strength of a second lobe.
        clearcoat_gloss: the coat's alpha goes from 0.1 to 0.001; None is 0.
    """

    base_color: Annotated[jax.Array, SHARE]
    roughness: Annotated[jax.Array, Range(ROUGHNESS.low**0.5, 1.0)]
    eta: Annotated[jax.Array, Range(1.0, 1e3)]
    metallic: Annotated[jax.Array, SHARE] | None = None
    anisotropic: Annotated[jax.Array, SHARE] | None = None
    spec_tint: Annotated[jax.Array, SHARE] | None = None
    sheen: Annotated[jax.Array, SHARE] | None = None
    sheen_tint: Annotated[jax.Array, SHARE] | None = None
    flatness: Annotated[jax.Array, SHARE] | None = None
    clearcoat: Annotated[jax.Array, SHARE] | None = None
    clearcoat_gloss: Annotated[jax.Array, SHARE] | None = None


def index_of_specular(specular: jax.Array) -> jax.Array:
    """The eta whose reflectance at normal incidence is 0.08 specular (Burley 2012, section 5.5): 1.5 at a half."""
    return 2.0 / (1.0 - safe_sqrt(0.08 * jnp.asarray(specular))) - 1.0


class _Pair(NamedTuple):
    """Both directions, lifted off the horizon, their half vector, and its cosine with either."""

    wi: jax.Array
    wo: jax.Array
    wh: jax.Array
    cos_d: jax.Array


def _pair(query: Query) -> _Pair:
    wi, wo = lift(query.wi), lift(query.wo)
    both = wi + wo
    return _Pair(wi, wo, safe_normalize(both), jnp.minimum(0.5 * safe_norm(both), 1.0))


def _eval(params: PrincipledParams, query: Query) -> jax.Array:
    pair = _pair(query)
    body = match_rank(params.base_color, query.wi.ndim) * _diffuse(params, pair)[..., None]
    if params.sheen is not None:
        body = body + _sheen(params, params.sheen, pair)
    # no lerp, which would leave the body's rounding on a pure metal
    f = body if params.metallic is None else body * (1.0 - _colour(params.metallic, body.ndim))
    f = f + _specular(params, pair)
    if params.clearcoat is not None:
        f = f + (params.clearcoat * _coat(params, pair))[..., None]
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _diffuse(params: PrincipledParams, pair: _Pair) -> jax.Array:
    """The body's f at base colour one, `(...)`."""
    cos_i, cos_o = cos_theta(pair.wi), cos_theta(pair.wo)
    grazing_i, grazing_o = _schlick_weight(cos_i), _schlick_weight(cos_o)
    retro = params.roughness * pair.cos_d * pair.cos_d
    # from one at the normal to F90 = 1/2 + 2 retro, or beneath the surface to retro, at grazing angles
    smooth = (1.0 + (2.0 * retro - 0.5) * grazing_i) * (1.0 + (2.0 * retro - 0.5) * grazing_o)
    flattened = (1.0 + (retro - 1.0) * grazing_i) * (1.0 + (retro - 1.0) * grazing_o)
    beneath = 1.25 * (flattened * (1.0 / (cos_i + cos_o) - 0.5) + 0.5)
    return _towards(smooth, beneath, params.flatness) / jnp.pi


def _sheen(params: PrincipledParams, share: jax.Array, pair: _Pair) -> jax.Array:
    rank = pair.wi.ndim
    white = jnp.ones_like(pair.wi)
    colour = _towards(white, match_rank(_hue(params.base_color), rank), _maybe_colour(params.sheen_tint, rank))
    return _colour(share * _schlick_weight(pair.cos_d), rank) * colour


def _specular(params: PrincipledParams, pair: _Pair) -> jax.Array:
    facets = _facets(params)
    lobe = facets.density(pair.wh) * separable_visibility(facets, pair.wi, pair.wo)
    return lobe[..., None] * _reflectance(params, pair.cos_d)


def _reflectance(params: PrincipledParams, cos: jax.Array) -> jax.Array:
    """F, `(..., 3)`."""
    rank = cos.ndim + 1
    base, eta = match_rank(params.base_color, rank), params.eta
    grey = jnp.broadcast_to(dielectric(cos, eta)[..., None], (*cos.shape, 3))
    f0 = jnp.square((eta - 1.0) / (eta + 1.0))
    tinted = schlick(cos[..., None], match_rank(_hue(params.base_color), rank) * _colour(f0, rank))
    plain = _towards(grey, tinted, _maybe_colour(params.spec_tint, rank))
    return _towards(plain, schlick(cos[..., None], base), _maybe_colour(params.metallic, rank))


def _coat(params: PrincipledParams, pair: _Pair) -> jax.Array:
    facets = Ggx(Isotropic(jnp.asarray(COAT_MASKING, pair.cos_d.dtype)))
    # Gc is a product of G1 = cos / area
    masking = [safe_divide(cos_theta(w), masked_area(facets, w)) for w in (pair.wi, pair.wo)]
    reflectance = schlick(pair.cos_d, jnp.asarray(COAT_F0, pair.cos_d.dtype))
    return 0.25 * _gtr1(_coat_alpha(params), pair.wh) * reflectance * masking[0] * masking[1]


def _gtr1(alpha: jax.Array, wh: jax.Array) -> jax.Array:
    """D = (1 - alpha^2) / (-pi log alpha^2 (sin_h^2 + alpha^2 cos_h^2)) [1/sr] (Burley 2012, Eq. 4), for alpha < 1."""
    squared = alpha * alpha
    spread = sum_of_squares(wh[..., :2]) + squared * wh[..., 2] * wh[..., 2]
    return jnp.where(wh[..., 2] > 0, (1.0 - squared) / (-jnp.pi * jnp.log(squared) * spread), 0.0)


def _sample_gtr1(alpha: jax.Array, u: jax.Array) -> jax.Array:
    """A normal of density D cos_h (Burley 2012, Eq. 5), from u `(..., 2)`; by the sine, which does not cancel."""
    squared = alpha * alpha
    sin_squared = squared * jnp.expm1(-u[..., 1] * jnp.log(squared)) / (1.0 - squared)
    sin, phi = safe_sqrt(sin_squared), 2.0 * jnp.pi * u[..., 0]
    return jnp.stack([sin * jnp.cos(phi), sin * jnp.sin(phi), safe_sqrt(1.0 - sin_squared)], axis=-1)


def _draw(params: PrincipledParams, wo: jax.Array, u: jax.Array) -> jax.Array:
    draws = [partial(COSINE.sample, None, wo), partial(VISIBLE_NORMALS.sample, _facets(params), wo)]
    if params.clearcoat is not None:
        draws.append(partial(_draw_coat, params, wo))
    return choose(_chances(params), draws, u)


def _draw_coat(params: PrincipledParams, wo: jax.Array, u: jax.Array) -> jax.Array:
    return reflect(wo, _sample_gtr1(_coat_alpha(params), u[..., 1:]))


def _density(params: PrincipledParams, wi: jax.Array, wo: jax.Array) -> jax.Array:
    densities = [COSINE.pdf(None, wi, wo), VISIBLE_NORMALS.pdf(_facets(params), wi, wo)]
    if params.clearcoat is not None:
        wh = safe_normalize(wi + wo)
        mirrored = safe_divide(_gtr1(_coat_alpha(params), wh) * wh[..., 2], 4.0 * dot(wo, wh))
        densities.append(jnp.where(above_horizon(wi, wo), mirrored, 0.0))
    return blend(_chances(params), densities)


def _chances(params: PrincipledParams) -> jax.Array:
    """Of the cosine, of the facets, and of the coat's where there is one."""
    one = jnp.ones_like(params.roughness)
    chances = [one if params.metallic is None else 1.0 - params.metallic, one]
    if params.clearcoat is not None:
        chances.append(0.25 * params.clearcoat)
    return jnp.stack(jnp.broadcast_arrays(*chances), axis=-1)


def _facets(params: PrincipledParams) -> Ggx:
    alpha = params.roughness * params.roughness
    if params.anisotropic is None:
        return Ggx(Isotropic(alpha))
    aspect = jnp.sqrt(1.0 - 0.9 * params.anisotropic)
    return Ggx(Axes(alpha / aspect, jnp.maximum(alpha * aspect, ROUGHNESS.low)))


def _coat_alpha(params: PrincipledParams) -> jax.Array:
    gloss = params.clearcoat_gloss
    return jnp.full_like(params.roughness, 0.1) if gloss is None else 0.1 - (0.1 - 0.001) * gloss


def _hue(base: jax.Array) -> jax.Array:
    """The colour over its luminance; white for black."""
    red, green, blue = LUMINANCE
    luminance = red * base[..., 0] + green * base[..., 1] + blue * base[..., 2]
    dark = luminance <= jnp.finfo(base.dtype).tiny
    return jnp.where(dark[..., None], 1.0, base / jnp.where(dark, 1.0, luminance)[..., None])


def _schlick_weight(cos: jax.Array) -> jax.Array:
    """(1 - cos)^5."""
    grazing = 1.0 - cos
    square = grazing * grazing
    return square * square * grazing


def _towards(start: jax.Array, end: jax.Array, share: jax.Array | None) -> jax.Array:
    """The point at `share` of the way; the start itself where there is none."""
    return start if share is None else start + share * (end - start)


def _colour(share: jax.Array, rank: int) -> jax.Array:
    """`()` or `(...)` as a factor of colours of that rank."""
    return match_rank(share[..., None], rank)


def _maybe_colour(share: jax.Array | None, rank: int) -> jax.Array | None:
    return None if share is None else _colour(share, rank)


_PROPOSAL = Proposal(_draw, _density)
PRINCIPLED = within_ranges(sampled_by(_PROPOSAL, _eval, lambda params: Proposed(params, params)))
