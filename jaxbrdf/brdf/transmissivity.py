"""How much of the light from one direction the facets of a rough dielectric let in, on average over those it meets.

T(w) is the mean of 1 - F(w . wh) over the visible normals wh, so what the same facets reflect, F G2 / G1 on average, is
at most 1 - T. Exactly the smooth interface's at small roughness, one at an index of one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.rough_interface import facet_transmittance
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import azimuth, dot
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.microsurface import standard_view


class _Rule(NamedTuple):
    """Points in the unit square of `sample_visible`, `(n, 2)`, and their weights, `(n,)`."""

    points: np.ndarray
    weights: np.ndarray


def _gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1.0), 0.5 * weights


def _product(first: tuple[np.ndarray, np.ndarray], second: tuple[np.ndarray, np.ndarray]) -> _Rule:
    points = np.stack(np.meshgrid(first[0], second[0], indexing="ij"), axis=-1).reshape(-1, 2)
    return _Rule(points, np.outer(first[1], second[1]).ravel())


def _about_and_away() -> _Rule:
    """GGX: 8 even turns about the view, 3 Gauss nodes away from it, crowded at the far end where F rises like a log."""
    points, weights = _gauss(3)
    away = 1.0 - np.square(1.0 - points), 2.0 * (1.0 - points) * weights
    return _product(((np.arange(8) + 0.5) / 8, np.full(8, 0.125)), away)


def _along_and_aside() -> _Rule:
    """Beckmann: 8 Gauss nodes of the slope along the view, 3 of the one aside, crowded at both ends."""
    points, weights = _gauss(3)
    aside = points * points * (3.0 - 2.0 * points), 6.0 * points * (1.0 - points) * weights
    return _product(_gauss(8), aside)


_RULES: Mapping[type, _Rule] = {Ggx: _about_and_away(), Beckmann: _along_and_aside()}


def transmissivity(facets: Ggx | Beckmann, eta: jax.Array, w: jax.Array) -> jax.Array:
    """T(w), `(...)`, within 0.005 of the mean over all facets.

    Args:
        facets: a `Ggx` or `Beckmann` record.
        eta: index of the far side over that of w's side.
        w: `(..., 3)`, above the horizon.
    """
    rule = _RULES[type(facets)]
    # GGX draws turns from the tangent on; counted from the view the rule is the same for every azimuth
    turned = isinstance(facets, Ggx)
    turn = azimuth(standard_view(*facets, w)) / (2.0 * jnp.pi) if turned else jnp.zeros_like(w[..., 2])

    def at(point: jax.Array, weight: jax.Array) -> jax.Array:
        about = jnp.mod(point[0] + turn, 1.0)
        wh = facets.sample_visible(w, jnp.stack([about, jnp.broadcast_to(point[1], about.shape)], axis=-1))
        return weight * facet_transmittance(jnp.clip(dot(w, wh), 0.0, 1.0), eta)

    parts = jax.vmap(at)(jnp.asarray(rule.points, w.dtype), jnp.asarray(rule.weights, w.dtype))
    # the weights' sum is rounded; the derivative by eta is zero there, as reflectance begins with (eta - 1)^2
    return jnp.where(eta == 1.0, 1.0, jnp.sum(parts, axis=0))
