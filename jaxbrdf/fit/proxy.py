"""The nine-number proxy fitted to a material's own light, for all views together.

For each view the light's target density is F = luminance of f cos(wi) over its integral. Integrals over wi are sums
over the same points for every step (`jaxbrdf.sampling.lights`), weighed by their density.

Two objectives, least where the proxy's density p is the target:

    cross-entropy   -integral F log p       above the target's own by the divergence of Kullback and Leibler
    second moment   log integral F^2 / p    of f cos / p over its square mean: of the noise under uniform light

The views are the nodes and the middles between them, so nodes are fitted as they will be interpolated. Each starts from
the best of a grid of round lobes, descends by cross-entropy, which sees a lobe from afar, and last by the objective.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Literal, NamedTuple

import jax
import jax.numpy as jnp
import optax

from jaxbrdf.core.colour import luminance
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.sampling.defensive import FLOOR
from jaxbrdf.sampling.hemisphere import cosine_density
from jaxbrdf.sampling.lights import lights_of_view
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.sampling.proxy import VISIBLE_PROXY, ProxyParams, to_unconstrained
from jaxbrdf.sampling.view_frame import to_view
from jaxbrdf.sampling.view_proxy import ViewProxy, proxy_at
from jaxbrdf.types import Params, Query

Objective = Literal["cross-entropy", "second moment"]

STARTS = tuple(product((1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8), (0.03, 0.1, 0.3, 0.6, 0.9)))
"""Roughness and weight of the round lobes that a node may start from, each about a factor of two from the next."""

LAST_ELEVATION = 1.55
"""Of the views that stand for the horizon, at which there is no light: 88.8 degrees."""

LEAST_DENSITY = 1e-12
"""Added to p, so that where float32 has nothing left of a density its logarithm stays finite."""

LAST_RATE = 0.3
"""Of the first rate, for the last stage: it starts close to where it ends."""


@dataclass(frozen=True)
class ProxyFit:
    """How a proxy is fitted.

    Attributes:
        proposal: `PROXY` or `VISIBLE_PROXY`.
        elevations, azimuths: of the nodes; one azimuth for an isotropic material.
        points: directions a view, even.
        steps: of Adam, by cross-entropy and again by the objective if that is another.
        rate: first learning rate of the unconstrained numbers; falls to zero by half a cosine.
        objective: what is minimised in the end.
    """

    proposal: Proposal = VISIBLE_PROXY
    elevations: int = 32
    azimuths: int = 1
    points: int = 2048
    steps: int = 200
    rate: float = 0.05
    objective: Objective = "second moment"


class Target(NamedTuple):
    """What the proxy is held against.

    Attributes:
        wi, wo: `(V, n, 3)` and `(V, 1, 3)`, in the frame in which the viewer's azimuth is zero.
        views: the viewers where they are, `(V, 3)`.
        weight: share of the light at each point, `(V, n)`, of sum one for each view.
        density: F there, `(V, n)` [1/sr].
    """

    wi: jax.Array
    wo: jax.Array
    views: jax.Array
    weight: jax.Array
    density: jax.Array


def fit_proxy(
    evaluate: Callable[[Params, Query], jax.Array], params: Params, *, config: ProxyFit = ProxyFit()
) -> ViewProxy:
    """The nodes of a proxy for the reflectance `evaluate(params, query)`."""
    return ViewProxy(_fit(config, light_of_views(config, evaluate, params)))


@partial(jax.jit, static_argnums=(0, 1))
def light_of_views(config: ProxyFit, evaluate: Callable[[Params, Query], jax.Array], params: Params) -> Target:
    """The light that the reflectance scatters to each view of the fit, at the points that the fit sums over."""
    views = _views(config)
    wo = jnp.broadcast_to(views[:, None], (len(views), config.points, 3))
    wi, density = jax.vmap(lights_of_view, in_axes=(0, None))(views, config.points)
    # view by view: a measured table's temporaries for all of them would be large
    f = jax.lax.map(lambda pair: luminance(evaluate(params, Query(*pair))), (wi, wo))
    light = jnp.maximum(f * wi[..., 2], 0.0)
    light = jnp.where(jnp.any(light > 0, axis=-1, keepdims=True), light, cosine_density(wi))
    total = jnp.mean(safe_divide(light, density), axis=-1, keepdims=True)
    weight = safe_divide(light, density) / (total * config.points)
    return Target(to_view(wi, wo), to_view(wo, wo)[:, :1], views, weight, light / total)


def _views(config: ProxyFit) -> jax.Array:
    """Viewers at the nodes and half way between elevations, `(V, 3)`."""
    theta = jnp.linspace(0.0, 0.5 * jnp.pi, 2 * config.elevations - 1)
    phi = jnp.arange(config.azimuths) * (2.0 * jnp.pi / config.azimuths)
    theta, phi = jnp.meshgrid(jnp.minimum(theta, LAST_ELEVATION), phi, indexing="ij")
    return spherical(theta.ravel(), phi.ravel())


@partial(jax.jit, static_argnums=0)
def _fit(config: ProxyFit, target: Target) -> jax.Array:
    """Nodes `(P, K, 9)`."""
    starts = jnp.asarray([_round_lobe(alpha, weight) for alpha, weight in STARTS])
    shape = (config.azimuths, config.elevations, starts.shape[-1])

    def of_start(start: jax.Array) -> jax.Array:
        return _losses(config, "cross-entropy", jnp.broadcast_to(start, shape), target)

    losses = jax.lax.map(of_start, starts)
    # of the views those at nodes, in the order of the nodes
    at_nodes = losses.reshape(len(starts), 2 * config.elevations - 1, config.azimuths)[:, ::2].swapaxes(1, 2)
    nodes = _descend(config, "cross-entropy", starts[jnp.argmin(at_nodes, axis=0)], target, config.rate)
    return (
        nodes
        if config.objective == "cross-entropy"
        else _descend(config, config.objective, nodes, target, LAST_RATE * config.rate)
    )


def _round_lobe(alpha: float, weight: float) -> jax.Array:
    """Unconstrained numbers of an upright cosine and a centred round lobe."""
    return to_unconstrained(ProxyParams(*map(jnp.float32, (1.0 - weight, 0.0, 0.0, weight, alpha, alpha, 0, 0, 0))))


def _descend(config: ProxyFit, objective: Objective, nodes: jax.Array, target: Target, rate: float) -> jax.Array:
    """Nodes after Adam's steps on the mean over views."""
    optimiser = optax.adam(optax.cosine_decay_schedule(rate, config.steps), b2=0.99)
    gradient = jax.grad(lambda nodes: jnp.mean(_losses(config, objective, nodes, target)))

    def step(_: int, state: tuple[jax.Array, optax.OptState]) -> tuple[jax.Array, optax.OptState]:
        updates, moments = optimiser.update(gradient(state[0]), state[1])
        return state[0] + jnp.asarray(updates), moments

    return jax.lax.fori_loop(0, config.steps, step, (nodes, optimiser.init(nodes)))[0]


def _losses(config: ProxyFit, objective: Objective, nodes: jax.Array, target: Target) -> jax.Array:
    """The objective of each view, `(V,)`."""
    params = proxy_at(ViewProxy(nodes), target.views)
    per_view = jax.tree.map(lambda x: x[:, None], params)
    density = config.proposal.pdf(per_view, target.wi, jnp.broadcast_to(target.wo, target.wi.shape))
    density = (1.0 - FLOOR) * density + FLOOR * cosine_density(target.wi) + LEAST_DENSITY
    if objective == "cross-entropy":
        return cross_entropy(target, density)
    return jnp.log(jnp.sum(target.weight * target.density / density, axis=-1))


def cross_entropy(target: Target, density: jax.Array) -> jax.Array:
    """-integral F log p of each view, `(V,)`, for p > 0 at the target's points, `(V, n)`."""
    return -jnp.sum(target.weight * jnp.log(density), axis=-1)
