"""LEADR mapping against the light that mirrors with Gaussian slopes send, counted one by one."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import spherical
from jaxbrdf.surface.leadr import leadr
from jaxbrdf.surface.slopes import pack_slopes
from jaxbrdf.texture.pyramid import Layout, build_pyramid
from tests.surface.maps import gaussian_slopes, metal, normals, whole

LAYOUT = Layout(32, 32)
DEVIATIONS, MEAN, ALPHA = (0.25, 0.12), (0.2, -0.1), 0.04
CONE = 0.15
"""Half the opening of the cones that light is counted in, radians."""


def mirrored(wo: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Light directions `(count, 3)` of mirrors whose slopes are the map's and the facets' own, and what each shows."""
    deviation = np.sqrt(np.square(DEVIATIONS) + 0.5 * ALPHA**2)
    slopes = np.random.default_rng(0).normal(size=(count, 2)) * deviation + MEAN
    facet = np.append(-slopes, np.ones((count, 1)), axis=-1)
    shown = facet @ wo
    return 2.0 * (shown / np.sum(facet * facet, -1))[:, None] * facet - wo, np.maximum(shown, 0.0)


def axes_of(about: np.ndarray) -> np.ndarray:
    first = np.cross(about, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(about, first), about])


@pytest.mark.parametrize("theta", [0.0, 0.5])
def test_light_goes_where_mirrors_send_it(theta: float):
    """f cos_i over a cone is the share of what the viewer sees that goes there, times what of it is not shadowed."""
    texels = build_pyramid(LAYOUT, pack_slopes(metal(ALPHA**0.5), normals(gaussian_slopes(32, DEVIATIONS, MEAN))))
    # on the side that facets lean to: their normals are those of minus the slope
    wo = np.asarray(spherical(jnp.float32(theta), jnp.float32(2.7)), float)
    wi, shown = mirrored(wo, 1_000_000)
    radius, turn = np.meshgrid((np.arange(12) + 0.5) / 12, 2 * np.pi * (np.arange(24) + 0.5) / 24)
    sin = np.sin(CONE) * radius.ravel()
    local = np.stack([sin * np.cos(turn.ravel()), sin * np.sin(turn.ravel()), np.sqrt(1 - sin**2)], axis=-1)
    # of a cell of the cone's disk, over its slant
    area = 2 * np.pi * np.sin(CONE) ** 2 * radius.ravel() / local[:, 2] / radius.size
    for about in np.asarray(spherical(jnp.array([0.3, 0.5, 0.7, 0.5]), jnp.array([2.7, 2.0, 3.5, 5.5])), float):
        inside = wi @ about > np.cos(CONE)
        light = local @ axes_of(about)
        f = leadr(LAYOUT, facets=Beckmann).eval(texels, whole(jnp.float32(light), jnp.float32(wo)))[:, 0]
        found = np.sum(np.asarray(f, float) * light[:, 2] * area)
        # a light sees the area of the facets that lean to it, no less than the plane's
        facing = np.maximum(about[2] - about[:2] @ np.array(MEAN), about[2])
        want = np.sum(shown[inside]) / len(shown) / max(wo[2] - wo[:2] @ np.array(MEAN), wo[2]) * about[2] / facing
        np.testing.assert_allclose(found, want, rtol=0.01 + 4 / np.sqrt(inside.sum()))
