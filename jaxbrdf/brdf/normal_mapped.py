"""Any BRDF about a shading normal n, as renderers map normals.

    f(wi, wo) = f_base(wi', wo') cos_i' / cos_i

w' is w seen in the frame of n, and cos_i' its cosine there: the light that comes back is f_base cos_i', and the cosine
of the surface itself is divided out. Zero where a direction is below the horizon of the surface or of n. n = (0, 0, 1)
is the base.

That quotient is what normal mapping does and no material can do: it is not reciprocal, and grows like 1 / cos_i
towards the horizon, where the cosine is raised to that of `jaxbrdf.core.smith.lift`. `reciprocal_normal_mapped` is its
reciprocal part, (f(wi, wo) + f(wo, wi)) / 2, by one evaluation of a reciprocal base.

The frame of n is that of the surface turned by the shortest way, which needs no tangent: n_z must be positive.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.directions import above_horizon, cos_theta, tilt, untilt
from jaxbrdf.core.numerics import match_rank, safe_divide
from jaxbrdf.core.smith import lift
from jaxbrdf.types import Brdf, Params, Query, Sample


class NormalMappedParams(NamedTuple):
    """normal: unit vector `(3,)` or `(..., 3)` with a positive z. base: parameters of the base."""

    normal: jax.Array
    base: Params


def normal_mapped(base: Brdf) -> Brdf:
    """`base` about a shading normal, with parameters `NormalMappedParams`; sampled where `base` is."""
    return _about_normal(base, _as_shaded)


def reciprocal_normal_mapped(base: Brdf) -> Brdf:
    """The reciprocal part of `normal_mapped` for a base that is reciprocal."""
    return _about_normal(base, _both_ways)


def _about_normal(base: Brdf, gain: Callable[[Query, Query], jax.Array]) -> Brdf:
    def evaluate(params: NormalMappedParams, query: Query) -> jax.Array:
        seen = _seen(params, query)
        f = base.eval(params.base, seen) * gain(seen, query)[..., None]
        return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)

    if base.sample is None or base.pdf is None:
        return Brdf(evaluate)
    sampler = sampler_of(base)

    def pdf(params: NormalMappedParams, query: Query) -> jax.Array:
        density = sampler.pdf(params.base, _seen(params, query))
        return jnp.where(above_horizon(query.wi, query.wo), density, 0.0)

    def sample(params: NormalMappedParams, query: Query, u: jax.Array) -> Sample:
        view = _seen(params, query._replace(wi=query.wo))
        seen = sampler.sample(params.base, view, u).wi
        wi = _lost_below(tilt(seen, _normal(params, query)), above_horizon(seen, view.wo))
        drawn = query._replace(wi=wi)
        density = pdf(params, drawn)
        weight = safe_divide(jnp.maximum(cos_theta(wi), 0.0), density)
        return Sample(wi, density, evaluate(params, drawn) * weight[..., None])

    return Brdf(evaluate, sample, pdf)


def _normal(params: NormalMappedParams, query: Query) -> jax.Array:
    return match_rank(params.normal, query.wo.ndim)


def _seen(params: NormalMappedParams, query: Query) -> Query:
    """The query in the frame of the normal."""
    normal = _normal(params, query)
    return query._replace(wi=untilt(query.wi, normal), wo=untilt(query.wo, normal))


def _lost_below(wi: jax.Array, kept: jax.Array) -> jax.Array:
    """wi where it is kept; elsewhere below the surface's horizon, where lost draws are looked for."""
    z = cos_theta(wi)
    return jnp.concatenate([wi[..., :2], jnp.where(kept, z, -jnp.abs(z))[..., None]], axis=-1)


def _as_shaded(seen: Query, query: Query) -> jax.Array:
    # where w' is below the horizon the base is zero
    return cos_theta(lift(seen.wi)) / cos_theta(lift(query.wi))


def _both_ways(seen: Query, query: Query) -> jax.Array:
    return 0.5 * (_as_shaded(seen, query) + cos_theta(lift(seen.wo)) / cos_theta(lift(query.wo)))
