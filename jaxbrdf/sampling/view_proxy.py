"""The proxy's nine numbers as functions of the viewer: nodes in elevation and azimuth, linear between them.

What is interpolated are the unconstrained numbers (`jaxbrdf.sampling.proxy`), so every mean of nodes is a valid proxy
and roughness moves by factors. Slopes count from the viewer's azimuth: one row of elevations serves an isotropic
material, and between the azimuths of an anisotropic one a lobe turns with the viewer.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import azimuth, cos_theta, sin_theta
from jaxbrdf.core.numerics import safe_atan2
from jaxbrdf.sampling.defensive import defensive
from jaxbrdf.sampling.proposal import Proposal
from jaxbrdf.sampling.proxy import PROXY, VISIBLE_PROXY, ProxyParams, from_unconstrained
from jaxbrdf.sampling.view_frame import from_view, to_view


class ViewProxy(NamedTuple):
    """nodes: unconstrained numbers, `(P, K, 9)`.

    P azimuths of the viewer in equal steps from zero (1 for an isotropic material) and K elevations in equal steps from
    the normal to the horizon, both included.
    """

    nodes: jax.Array


def proxy_at(view_proxy: ViewProxy, wo: jax.Array) -> ProxyParams:
    """The proxy for viewers `(..., 3)`, in the frame in which their azimuth is zero."""
    turns, elevations, _ = view_proxy.nodes.shape
    theta = safe_atan2(sin_theta(wo), jnp.maximum(cos_theta(wo), 0.0))
    step = theta * (2.0 * (elevations - 1) / jnp.pi)
    low = jnp.clip(jnp.floor(step), 0, max(elevations - 2, 0))
    k, along = low.astype(jnp.int32), (step - low)[..., None]
    turn = azimuth(wo) * (turns / (2.0 * jnp.pi))
    before = jnp.floor(turn)
    j, across = jnp.mod(before, turns).astype(jnp.int32), (turn - before)[..., None]

    def between_elevations(j: jax.Array) -> jax.Array:
        nodes = view_proxy.nodes
        return nodes[j, k] * (1.0 - along) + nodes[j, jnp.minimum(k + 1, elevations - 1)] * along

    if turns == 1:
        return from_unconstrained(between_elevations(j))
    return from_unconstrained(between_elevations(j) * (1.0 - across) + between_elevations((j + 1) % turns) * across)


def of_view(proxy: Proposal) -> Proposal:
    """A proposal of `ProxyParams` as one of a `ViewProxy`, with a share of cosine-distributed draws."""

    def sample(view_proxy: ViewProxy, wo: jax.Array, u: jax.Array) -> jax.Array:
        return from_view(proxy.sample(proxy_at(view_proxy, wo), to_view(wo, wo), u), wo)

    def pdf(view_proxy: ViewProxy, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return proxy.pdf(proxy_at(view_proxy, wo), to_view(wi, wo), to_view(wo, wo))

    return defensive(Proposal(sample, pdf))


VIEW_PROXY = of_view(PROXY)
"""Zeltner et al.'s proxy, of a `ViewProxy`."""

VISIBLE_VIEW_PROXY = of_view(VISIBLE_PROXY)
"""Its variant with visible normals, of a `ViewProxy`."""
