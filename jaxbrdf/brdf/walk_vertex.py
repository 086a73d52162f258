"""What happens to a walk where it meets a layer: the vertices of `jaxbrdf.brdf.position_free`.

Directions point away from the vertex: w back to where the walk comes from, v to where the light comes from.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.rough_interface import (
    ROUGH_INTERFACE,
    InterfaceParams,
    index_across,
    reflect_at,
    reflection,
    refract_at,
    transmission,
    transmitted_density,
    turned_up,
)
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.medium import Medium, phase, sample_phase
from jaxbrdf.core.smith import correlated_visibility, lift
from jaxbrdf.core.tree import select
from jaxbrdf.types import Brdf, Params, Query


class Light(NamedTuple):
    """How light from above comes in by one facet of the uppermost interface.

    Attributes:
        v: to where it comes from, inside.
        density: of -v.
        gain: f_t |cos| over that density, for what goes from inside to where it came from.
    """

    v: jax.Array
    density: jax.Array
    gain: jax.Array


class Vertex(NamedTuple):
    """What a vertex does.

    Attributes:
        value: f of the light that arrives along its v, `(..., 3)` or `(..., 1)`.
        density: of drawing v.
        wi: a drawn direction, with its `drawn_density` and `weight`.
    """

    value: jax.Array
    density: jax.Array
    wi: jax.Array
    drawn_density: jax.Array
    weight: jax.Array


def refracted_light(interface: InterfaceParams, wi: jax.Array, u: jax.Array) -> Light:
    """wi through one of the facets that it sees, by u `(2, ...)`."""
    wh = interface.distribution.sample_visible(lift(turned_up(wi)), _last(u))
    into = refract_at(interface, wi, wh)
    eta = index_across(interface, wi)
    return Light(-into.wi, into.pdf, into.share * into.passed / (eta * eta))


def at_top(interface: InterfaceParams, wi: jax.Array, w: jax.Array, u: jax.Array) -> Vertex:
    """At the uppermost interface: what leaves towards wi, and a direction into the stack, which a walk never leaves."""
    f = reflection(interface, wi, w, visibility=correlated_visibility) + transmission(interface, wi, w)
    wh = interface.distribution.sample_visible(lift(turned_up(w)), _last(u[1:3]))
    into, back = refract_at(interface, w, wh), reflect_at(interface, w, wh, visibility=correlated_visibility)
    drawn = select(w[..., 2] > 0, into, back)
    weight = jnp.broadcast_to((drawn.share * drawn.passed)[..., None], w.shape)
    return Vertex(f[..., None], transmitted_density(interface, w, wi), drawn.wi, drawn.pdf, weight)


def at_interface(interface: InterfaceParams, v: jax.Array, w: jax.Array, u: jax.Array) -> Vertex:
    """At an interface further down: reflected or refracted by the chance that Fresnel's share gives."""
    f = reflection(interface, v, w, visibility=correlated_visibility) + transmission(interface, v, w)
    wh = interface.distribution.sample_visible(lift(turned_up(w)), _last(u[1:3]))
    back, through = reflect_at(interface, w, wh, visibility=correlated_visibility), refract_at(interface, w, wh)
    drawn = select(u[0] < back.share, back, through)
    assert ROUGH_INTERFACE.pdf is not None
    density = ROUGH_INTERFACE.pdf(interface, Query(v, w))
    weight = jnp.broadcast_to(drawn.passed[..., None], w.shape)
    return Vertex(f[..., None], density, drawn.wi, drawn.share * drawn.pdf, weight)


def in_medium(medium: Medium, v: jax.Array, w: jax.Array, u: jax.Array) -> Vertex:
    """At a scatterer: by the phase function."""
    wi = sample_phase(medium, w, u[1:3])
    value = phase(medium, v, w)
    # per solid angle, where a surface's is per projected one
    steep = jnp.maximum(v[..., 2], jnp.finfo(value.dtype).eps)
    return Vertex((value / steep)[..., None], value, wi, phase(medium, wi, w), jnp.ones_like(wi))


def at_base(base: Brdf, params: Params, query: Query, u: jax.Array) -> Vertex:
    """At the base, which has wi = v and wo = w."""
    sampler = sampler_of(base)
    drawn = sampler.sample(params, query, _last(u[:3]))
    return Vertex(base.eval(params, query), sampler.pdf(params, query), drawn.wi, drawn.pdf, drawn.weight)


def _last(u: jax.Array) -> jax.Array:
    """Numbers `(n, ...)` as `(..., n)`."""
    return jnp.moveaxis(u, 0, -1)
