"""The proxy's nine numbers as functions of the viewer: nodes in elevation and azimuth, linear between them.

What is interpolated are the unconstrained numbers (`jaxbrdf.sampling.proxy`), so every mean of nodes is a valid proxy
and roughness moves by factors. Slopes count from the viewer's azimuth: one row of elevations serves an isotropic
material, and between the azimuths of an anisotropic one a lobe turns with the viewer.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import azimuth, cos_theta, heading, sin_theta
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.numerics import safe_atan2
from jaxbrdf.core.roughness import InFrame
from jaxbrdf.sampling.defensive import defensive
from jaxbrdf.sampling.mixture import MixtureParams, mixture
from jaxbrdf.sampling.proposal import VISIBLE_NORMALS, Proposal
from jaxbrdf.sampling.proxy import MIRRORED_NORMALS, TILTED_COSINE, ProxyParams, from_unconstrained, lobes_of
from jaxbrdf.sampling.tilted_cosine import Tilt


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


def lobes_towards(view_proxy: ViewProxy, wo: jax.Array) -> MixtureParams:
    """The proxy's lobes for viewers `(..., 3)`, in the material's own frame.

    The lobes are turned and not the directions: two that are opposed have a half vector in the digits of their sum, and
    turning each of them leaves rounding there.
    """
    (tilt, normals), chances = lobes_of(proxy_at(view_proxy, wo))
    frame = heading(wo)
    slope = jnp.stack(_turn(normals.slope[..., 0], normals.slope[..., 1], *frame), axis=-1)
    tilted = Tilt(*_turn(tilt.slope_x, tilt.slope_y, *frame))
    return MixtureParams((tilted, Ggx(InFrame(normals.roughness, *frame), slope)), chances)


def _turn(x: jax.Array, y: jax.Array, cos: jax.Array, sin: jax.Array) -> tuple[jax.Array, jax.Array]:
    return cos * x - sin * y, cos * y + sin * x


def of_view(normals: Proposal) -> Proposal:
    """A tilted cosine and a proposal of a `Ggx`, of a `ViewProxy`; with a share of cosine-distributed draws."""
    lobes = mixture(TILTED_COSINE, normals)

    def sample(view_proxy: ViewProxy, wo: jax.Array, u: jax.Array) -> jax.Array:
        return lobes.sample(lobes_towards(view_proxy, wo), wo, u)

    def pdf(view_proxy: ViewProxy, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return lobes.pdf(lobes_towards(view_proxy, wo), wi, wo)

    return defensive(Proposal(sample, pdf))


VIEW_PROXY = of_view(MIRRORED_NORMALS)
"""Zeltner et al.'s proxy, of a `ViewProxy`."""

VISIBLE_VIEW_PROXY = of_view(VISIBLE_NORMALS)
"""Its variant with visible normals, of a `ViewProxy`."""
