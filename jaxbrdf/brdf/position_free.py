"""What a stack of rough interfaces and media over a base reflects, by position-free random walks (Guo et al. 2018).

Layers are wide, so a path is known by its depth and its directions. A walk follows the flux that enters along wo, and
every vertex in the uppermost layer is connected to wi through the uppermost interface in two ways, weighed by the
balance heuristic: the light's own refraction at one of its facets is met at the vertex, and the direction that the
vertex draws is met at the interface. Walks end by Russian roulette alone, so the estimate is unbiased; there is no
greatest length. The code that runs is that of the layers that are there: no medium, no free flight.

Both ends lie in one medium, so the squares of the indices that radiance carries across an interface cancel
(`jaxbrdf.brdf.rough_interface`). The base's own indices are relative to the medium above it.

Only vertices of the uppermost layer are connected, so what lies below a second interface is noisier. Values only: the
walk's length depends on its parameters, and no derivative goes through it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.rough_interface import InterfaceParams
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.brdf.walk_vertex import Light, Vertex, at_base, at_interface, at_top, in_medium, refracted_light
from jaxbrdf.core.directions import above_horizon
from jaxbrdf.core.medium import Medium, fly, transmittance
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.core.ranges import clamp
from jaxbrdf.core.tree import select
from jaxbrdf.sampling.mis import balance_heuristic
from jaxbrdf.types import Brdf, NoisyValue, Params, Query

PATHS_IN_A_ROW = 16
"""Of one lane; a lane that is done waits for the longest path, and this makes the wait a small part."""

MOST_SURVIVAL = 1.0 - 2.0**-8
"""Chance to go on of a path that has lost nothing: a path in a white stack ends some time too."""

NUMBERS = 6
"""Random numbers that one vertex takes: three for the direction, two for the flight, one spare for the roulette."""


class StackParams(NamedTuple):
    """A stack from the top.

    Attributes:
        interfaces: at least one; each one's eta is the index below it over that above it.
        media: what lies below each interface, None where nothing does.
        base: parameters of the base's BRDF.
    """

    interfaces: tuple[InterfaceParams, ...]
    media: tuple[Medium | None, ...]
    base: Params


class PositionFree(NamedTuple):
    """The estimators of a stack.

    Attributes:
        estimate: `(key, params, query, *, samples) -> NoisyValue`. The least multiple of the
            lanes' number is drawn that is not below `samples`.
        noisy_eval: `(key, params, query) -> f` of one walk for each query, `(..., 3)`, unbiased.
    """

    estimate: Callable[..., NoisyValue]
    noisy_eval: Callable[[jax.Array, StackParams, Query], jax.Array]


class _Path(NamedTuple):
    """A walk before its next vertex.

    Attributes:
        place: 2 j at interface j, the base being the last, 2 j + 1 in the medium below it, -1 where the walk is over.
        w: from the vertex back to where the walk comes from.
        flux: `(..., 3)`.
        density: of the direction that the last vertex drew.
        depth: in the medium, of the next vertex.
        value: f so far.
    """

    place: jax.Array
    w: jax.Array
    flux: jax.Array
    density: jax.Array
    depth: jax.Array
    value: jax.Array


class _Run(NamedTuple):
    """A lane's current path and its finished ones: their number, mean and sum of squared distances from it."""

    key: jax.Array
    path: _Path
    done: jax.Array
    mean: jax.Array
    squares: jax.Array


def position_free(base: Brdf) -> PositionFree:
    """The estimators of stacks over `base`.

    Raises:
        ValueError: the base has no sampler.
    """
    sampler_of(base)

    def estimate(key: jax.Array, params: StackParams, query: Query, *, samples: int) -> NoisyValue:
        lanes = max(1, samples // PATHS_IN_A_ROW)
        paths = -(-samples // lanes)
        runs = _walk(key, base, params, query, lanes, paths)
        value = jnp.mean(runs.mean, axis=0)
        spread = jnp.sum(runs.squares, axis=0) + paths * jnp.sum(jnp.square(runs.mean - value[None]), axis=0)
        count = lanes * paths
        return NoisyValue(value, jnp.sqrt(spread / (float(count) * max(count - 1, 1))))

    def noisy_eval(key: jax.Array, params: StackParams, query: Query) -> jax.Array:
        return _walk(key, base, params, query, 1, 1).mean[0]

    return PositionFree(estimate, noisy_eval)


def _walk(key: jax.Array, base: Brdf, params: StackParams, query: Query, lanes: int, paths: int) -> _Run:
    """`paths` walks in each of `lanes` lanes, the results' first axis."""
    if len(params.interfaces) != len(params.media) or not params.interfaces:
        raise ValueError(
            f"params has {len(params.interfaces)} interfaces and {len(params.media)} media; "
            "a stack needs at least one interface, and a medium or None below each"
        )
    params = clamp(params)
    start = _start(query)
    count, nothing = jnp.zeros_like(start.place), jnp.zeros_like(start.flux)
    first = jax.vmap(lambda key: _Run(key, start, count, nothing, nothing))(jax.random.split(key, lanes))
    step = jax.vmap(partial(_step, base, params, query, paths))
    return jax.lax.while_loop(lambda runs: jnp.any(runs.done < paths), step, first)


def _start(query: Query) -> _Path:
    wo = query.wo
    none = jnp.zeros_like(wo[..., 2])
    place = jnp.zeros(none.shape, jnp.int32)
    return _Path(place, wo, jnp.ones_like(wo), none, none, jnp.zeros_like(wo))


def _step(base: Brdf, params: StackParams, query: Query, paths: int, run: _Run) -> _Run:
    """Every path past the interfaces, media and base that it meets in their order, and new paths for those that end."""
    key, own = jax.random.split(run.key)
    kinds = [kind for kind in range(2 * len(params.media) + 1) if _exists(params, kind)]
    numbers = jax.random.uniform(own, (len(kinds) + 1, NUMBERS, *run.done.shape), run.path.flux.dtype)
    light = refracted_light(params.interfaces[0], query.wi, numbers[-1, 1:3])
    path = run.path
    for u, kind in zip(numbers, kinds, strict=False):
        path = _past(base, params, query, light, kind, path, u)
    return _kept(query, paths, run._replace(key=key, path=_survivor(path, numbers[-1, 0])))


def _exists(params: StackParams, kind: int) -> bool:
    """Whether the place is there: every interface and the base, and the media that scatter."""
    medium = params.media[kind // 2] if kind % 2 else None
    return kind % 2 == 0 or (medium is not None and medium.scattering is not None)


def _past(base: Brdf, params: StackParams, query: Query, light: Light, kind: int, path: _Path, u: jax.Array) -> _Path:
    """The paths that are at this place after their vertex there and the flight that follows; others unchanged."""
    here = path.place == kind
    if kind == 0:
        vertex = at_top(params.interfaces[0], query.wi, path.w, u)
        share = jnp.where(path.w[..., 2] > 0, 1.0, balance_heuristic(path.density, vertex.density))
        value = path.flux * vertex.value * share[..., None]
    else:
        vertex = _vertex(base, params, query, light, kind, path, u)
        value = _connected(params, light, kind, path, vertex) if kind <= 2 else jnp.zeros_like(path.value)
    moved = _flown(params, kind, path, vertex, u[3:5])._replace(value=path.value + value)
    return select(here, moved, path)


def _vertex(
    base: Brdf, params: StackParams, query: Query, light: Light, kind: int, path: _Path, u: jax.Array
) -> Vertex:
    at, medium = kind // 2, params.media[kind // 2] if kind % 2 else None
    if medium is not None:
        return in_medium(medium, light.v, path.w, u)
    if at < len(params.interfaces):
        return at_interface(params.interfaces[at], light.v, path.w, u)
    return at_base(base, params.base, query._replace(wi=light.v, wo=path.w), u)


def _connected(params: StackParams, light: Light, kind: int, path: _Path, vertex: Vertex) -> jax.Array:
    """What a vertex of the uppermost layer sends to wi by way of the light's own refraction."""
    depth = path.depth if kind == 1 else jnp.ones_like(path.depth)
    share = balance_heuristic(light.density, vertex.density) * light.gain
    crossed = transmittance(params.media[0], depth, light.v)
    return jnp.where(light.v[..., 2:] > 0, path.flux * vertex.value * crossed * share[..., None], 0.0)


def _flown(params: StackParams, kind: int, path: _Path, vertex: Vertex, u: jax.Array) -> _Path:
    """The path at its next place, from the vertex along the direction that it drew."""
    flux, at, down = path.flux * vertex.weight, kind // 2, vertex.wi[..., 2] < 0
    path = path._replace(w=-vertex.wi, flux=flux, density=vertex.drawn_density)
    if kind % 2:
        return _through(params.media[at], at, path, path.depth, u)
    above = None if kind == 0 else _through(params.media[at - 1], at - 1, path, jnp.ones_like(path.depth), u)
    if kind == 2 * len(params.media):
        return select(down, path._replace(place=jnp.full_like(path.place, -1)), above)
    below = _through(params.media[at], at, path, jnp.zeros_like(path.depth), u)
    return select(down, below, path._replace(place=jnp.full_like(path.place, -1)) if above is None else above)


def _through(medium: Medium | None, at: int, path: _Path, depth: jax.Array, u: jax.Array) -> _Path:
    """A path that leaves this depth of the medium below interface `at`, at the next scattering or at the boundary."""
    w = -path.w
    boundary = jnp.where(w[..., 2] > 0, 2 * at, 2 * at + 2).astype(path.place.dtype)
    if medium is None or medium.scattering is None:
        return path._replace(place=boundary, flux=path.flux * transmittance(medium, jnp.ones_like(depth), w))
    flight = fly(medium, depth, w, u)
    place = jnp.where(flight.scattered, 2 * at + 1, boundary)
    return path._replace(place=place, flux=path.flux * flight.kept, depth=flight.depth)


def _survivor(path: _Path, u: jax.Array) -> _Path:
    """The path, or its end by a chance that its flux decides (Russian roulette)."""
    chance = jnp.minimum(jnp.max(path.flux, axis=-1), MOST_SURVIVAL)
    on = (path.place >= 0) & (u < chance)
    flux = safe_divide(path.flux, jnp.broadcast_to(chance[..., None], path.flux.shape))
    return path._replace(place=jnp.where(on, path.place, -1), flux=flux)


def _kept(query: Query, paths: int, run: _Run) -> _Run:
    """Finished paths counted, with mean and squares by Welford's update, and new ones begun."""
    over = (run.path.place < 0) & (run.done < paths)
    done = jnp.where(over, run.done + 1, run.done)
    value = jnp.where(above_horizon(query.wi, query.wo)[..., None], run.path.value, 0.0)
    step = jnp.where(over[..., None], value - run.mean, 0.0)
    mean = run.mean + step / jnp.maximum(done, 1)[..., None]
    squares = run.squares + step * (value - mean)
    fresh = over & (done < paths)
    path = select(fresh, _start(query), run.path)
    return _Run(run.key, path, done, mean, squares)
