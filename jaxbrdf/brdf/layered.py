"""A rough dielectric coat, clear or tinted, over any base: analytic layering after Weidlich and Wilkie (2007).

    f = f_coat + T_i T_o A B f_base(wi', wo') / eta^2,   A = exp(-a (1 / cos_i' + 1 / cos_o'))

f_coat is `MICROFACET`'s with the coat's index. Light is refracted at the coat's mean plane, w' = (x / eta, y / eta, .);
T is what the facets that w sees let in on average. Against the paper: 1 / eta^2, the compression of solid angle,
without which the base gains energy; T of rough facets; and B, for what the coat's underside throws back:

    B = 1 / (1 - m),   m = min(m_i, m_o),   m = albedo(w') (1 - T) exp(-2 a / cos')    base that reflects like a mirror
    m = albedo(w') R_in                                                                 base that reflects diffusely

the sums of the series of internal reflections, exact for a smooth coat over a mirror or over a Lambert body; R_in is
the coat's reflectance for diffuse light from within, absorption included. Of a base without `albedo` m takes the albedo
as one, and dark bases come out too bright by up to 1 - F times that. The first form never gives back more than falls on
the material, whatever the base: T / (1 - m) <= 1 for either direction. The second needs a base about as diffuse as
Lambert's.

A coat of index one and no absorption is not there: every factor is exactly one, and f and its samples are the base's.

What is left out: a rough coat does not widen the base's lobe, and a coat does not scatter; `jaxbrdf.brdf.position_free`
has both. Reciprocal where the base is. The base's own indices are relative to the coat's.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams
from jaxbrdf.brdf.sampler import Sampler, sampler_of
from jaxbrdf.brdf.transmissivity import transmissivity
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import above_horizon, cos_theta
from jaxbrdf.core.fresnel import Dielectric
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.medium import DEPTH
from jaxbrdf.core.numerics import match_rank, safe_divide, safe_sqrt
from jaxbrdf.core.ranges import Range
from jaxbrdf.core.smith import lift
from jaxbrdf.sampling.mixture import blend, choose
from jaxbrdf.sampling.proposal import COSINE, VISIBLE_NORMALS
from jaxbrdf.types import Brdf, Params, Query, Sample

COAT_INDEX = Range(1.0, 10.0)
"""Of a coat over the outside; what is rarer would reflect totally from without."""

_NODES = 8

_TURN = 0.25 * np.pi
"""Azimuth at which an anisotropic coat's diffuse reflectance is taken, between the axes of the frame."""


class LayeredParams(NamedTuple):
    """A coat and what lies below it.

    Attributes:
        coat: of the coat's facets.
        eta: the coat's index over that of the outside, `()` or `(...)`.
        base: parameters of the base.
        absorption: optical depth of the coat along the normal, `(3,)` or `(..., 3)`; None is clear.
    """

    coat: Ggx | Beckmann
    eta: Annotated[jax.Array, COAT_INDEX]
    base: Params
    absorption: Annotated[jax.Array, DEPTH] | None = None


def layered(base: Brdf, *, diffuse: bool = False) -> Brdf:
    """The coat over `base`, with parameters `LayeredParams`.

    Sampled as a mixture: the coat by its visible normals and the base by its own sampler inside the coat, or by the
    cosine outside it where the base is diffuse.

    Args:
        diffuse: whether the base scatters what reaches it about as evenly as Lambert's.

    Raises:
        ValueError: the base has no sampler, or is diffuse and has no albedo.
    """
    if diffuse and base.albedo is None:
        raise ValueError("base has no albedo; under diffuse=True the light that is reflected inside depends on it")
    inner = _cosine_sampler() if diffuse else _inner_sampler(sampler_of(base))
    gain = _diffuse_gain if diffuse else _mirror_gain

    def evaluate(params: LayeredParams, query: Query) -> jax.Array:
        wi, wo = lift(query.wi), lift(query.wo)
        below = query._replace(wi=_inside(params.eta, wi), wo=_inside(params.eta, wo))
        into, out_of = jax.vmap(partial(transmissivity, params.coat, params.eta))(jnp.stack([wi, wo]))
        passed = (into * out_of / (params.eta * params.eta))[..., None]
        through = passed * _crossed(params, below.wi, below.wo) * gain(base, params, below, into, out_of)
        coat = MICROFACET.eval(MicrofacetParams(params.coat, Dielectric(params.eta)), query)
        f = coat + through * base.eval(params.base, below)
        return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)

    def pdf(params: LayeredParams, query: Query) -> jax.Array:
        coat = VISIBLE_NORMALS.pdf(params.coat, query.wi, query.wo)
        density = blend(_chances(params, query), [coat, inner.pdf(params, query)])
        return jnp.where(above_horizon(query.wi, query.wo), density, 0.0)

    def sample(params: LayeredParams, query: Query, u: jax.Array) -> Sample:
        draws = [
            lambda v: VISIBLE_NORMALS.sample(params.coat, query.wo, v),
            lambda v: inner.sample(params, query, v),
        ]
        drawn = query._replace(wi=choose(_chances(params, query), draws, u))
        density = pdf(params, drawn)
        light = evaluate(params, drawn) * jnp.maximum(cos_theta(drawn.wi), 0.0)[..., None]
        weight = safe_divide(light, jnp.broadcast_to(density[..., None], light.shape))
        return Sample(drawn.wi, density, weight)

    return within_ranges(Brdf(evaluate, sample, pdf))


class _Inner(NamedTuple):
    """How light that reaches the base is drawn: `(params, query, u) -> wi` outside the coat, and its density there."""

    sample: Callable[[LayeredParams, Query, jax.Array], jax.Array]
    pdf: Callable[[LayeredParams, Query], jax.Array]


def _cosine_sampler() -> _Inner:
    return _Inner(
        lambda params, query, u: COSINE.sample(None, query.wo, u),
        lambda params, query: COSINE.pdf(None, query.wi, query.wo),
    )


def _inner_sampler(base: Sampler) -> _Inner:
    """The base's own draws, refracted out; those under total reflection are lost."""

    def sample(params: LayeredParams, query: Query, u: jax.Array) -> jax.Array:
        view = _inside(params.eta, lift(query.wo))
        return _outside(params.eta, base.sample(params.base, query._replace(wi=view, wo=view), u).wi)

    def pdf(params: LayeredParams, query: Query) -> jax.Array:
        wi = lift(query.wi)
        light = _inside(params.eta, wi)
        below = query._replace(wi=light, wo=_inside(params.eta, lift(query.wo)))
        # d w' / d w = cos / (eta^2 cos')
        compressed = cos_theta(wi) / (params.eta * params.eta * cos_theta(light))
        return base.pdf(params.base, below) * compressed

    return _Inner(sample, pdf)


def _chances(params: LayeredParams, query: Query) -> jax.Array:
    """Of the coat and of the base: the shares of the light that go there."""
    into = transmissivity(params.coat, params.eta, lift(query.wo))
    return jnp.stack([1.0 - into, into], axis=-1)


def _inside(eta: jax.Array, w: jax.Array) -> jax.Array:
    """w refracted into the coat, as it is known in there; w itself to the last bit for eta = 1."""
    z = cos_theta(w)
    steep = safe_sqrt((eta - 1.0) * (eta + 1.0) + z * z)
    return jnp.stack([w[..., 0], w[..., 1], steep], axis=-1) / match_rank(eta[..., None], w.ndim)


def _outside(eta: jax.Array, w: jax.Array) -> jax.Array:
    """Inverse of `_inside`; straight down where there is no direction outside."""
    z = eta * cos_theta(w)
    squared = z * z - (eta - 1.0) * (eta + 1.0)
    out = (cos_theta(w) > 0) & (squared > 0)
    scale = match_rank(eta[..., None], w.ndim)
    raised = jnp.concatenate([scale * w[..., :2], safe_sqrt(squared)[..., None]], axis=-1)
    return jnp.where(out[..., None], raised, jnp.asarray((0.0, 0.0, -1.0), w.dtype))


def _crossed(params: LayeredParams, *inside: jax.Array) -> jax.Array:
    """A: what the coat's medium leaves of light along these directions, `(..., 3)`."""
    if params.absorption is None:
        return jnp.ones_like(inside[0])
    length = sum(1.0 / cos_theta(w) for w in inside)
    return jnp.exp(-match_rank(params.absorption, inside[0].ndim) * jnp.asarray(length)[..., None])


def _mirror_gain(base: Brdf, params: LayeredParams, below: Query, into: jax.Array, out_of: jax.Array) -> jax.Array:
    """B where light meets the coat from within at the angle at which it entered."""

    def lost(w: jax.Array, passed: jax.Array) -> jax.Array:
        # 1 - m, without the difference
        back, through = _albedo(base, params, below, w) * _crossed(params, w, w), passed[..., None]
        return through + (1.0 - through) * (1.0 - back)

    return 1.0 / jnp.maximum(lost(below.wi, into), lost(below.wo, out_of))


def _diffuse_gain(base: Brdf, params: LayeredParams, below: Query, into: jax.Array, out_of: jax.Array) -> jax.Array:
    """B where light meets the coat from within at every angle."""
    del into, out_of
    back = match_rank(diffuse_return(params), below.wi.ndim)
    least = jnp.minimum(_albedo(base, params, below, below.wi), _albedo(base, params, below, below.wo))
    return 1.0 / (1.0 - least * back)


def _albedo(base: Brdf, params: LayeredParams, below: Query, w: jax.Array) -> jax.Array:
    if base.albedo is None:
        return jnp.ones_like(w)
    return base.albedo(params.base, below._replace(wi=w, wo=w))


def diffuse_return(params: LayeredParams) -> jax.Array:
    """R_in: what comes back to a diffuse base of the light it sends up, `(3,)` or `(..., 3)`.

    Beyond the critical cosine c it is the integral of 2 cos exp(-2 a / cos) from 0 to c. The rest comes from outside by
    reciprocity, the integral of 2 cos (1 - T) exp(-2 a / cos') over the cosines outside, over eta^2. By Gauss-Legendre
    nodes, in the root of the cosine outside, where T is smooth at grazing angles.
    """
    points, weights = np.polynomial.legendre.leggauss(_NODES)
    points, weights = 0.5 * (points + 1.0), 0.5 * weights
    shape = jnp.broadcast_shapes(jnp.shape(params.eta), *map(jnp.shape, jax.tree.leaves(params.coat.roughness)))
    critical = safe_sqrt(1.0 - 1.0 / (params.eta * params.eta))
    dtype = params.eta.dtype

    def beyond(point: jax.Array, weight: jax.Array) -> jax.Array:
        cos = jnp.broadcast_to(critical * point, shape)
        # where there is no critical angle, nothing is beyond
        w = _along(jnp.zeros(shape, dtype), jnp.maximum(cos, jnp.finfo(dtype).eps))
        return (2.0 * weight * critical * cos)[..., None] * _crossed(params, w, w)

    def within(point: jax.Array, weight: jax.Array) -> jax.Array:
        w = _along(jnp.full(shape, _TURN, dtype), jnp.broadcast_to(point * point, shape))
        inside = _inside(params.eta, w)
        kept = (1.0 - transmissivity(params.coat, params.eta, w))[..., None] * _crossed(params, inside, inside)
        return (4.0 * weight * point * point * point / (params.eta * params.eta))[..., None] * kept

    nodes = jnp.asarray(points, dtype), jnp.asarray(weights, dtype)
    return jnp.sum(jax.vmap(beyond)(*nodes) + jax.vmap(within)(*nodes), axis=0)


def _along(turn: jax.Array, cos: jax.Array) -> jax.Array:
    sin = safe_sqrt((1.0 - cos) * (1.0 + cos))
    return jnp.stack([sin * jnp.cos(turn), sin * jnp.sin(turn), cos], axis=-1)
