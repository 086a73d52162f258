"""What the maps of a surface say of each texel of its pyramid, as numbers that latents can start from."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.surface.textured import unpack
from jaxbrdf.texture.pyramid import Layout, build_pyramid, level

LEAST_HEIGHT = 0.2
"""Of a mean normal whose slopes are taken: steeper ones, beyond 78 degrees, count as that steep."""


def features_of(layout: Layout, texels: jax.Array) -> jax.Array:
    """Features of every texel, `(texels, 10)`: slopes of the mean normal, mean base colour, metallic and roughness, and
    the second moments xx, yy and xy of normals about their mean, which say how far a coarse texel scatters light.

    Args:
        layout: of the pyramid.
        texels: `surface.textured.surface_of`'s, `(texels, 8)`.
    """
    normal, maps = unpack(level(layout, texels, 0))
    x, y, z = normal[..., 0], normal[..., 1], normal[..., 2]
    own = jnp.stack([maps.metallic, maps.roughness, x, y, z, x * x, y * y, x * y], axis=-1)
    means = build_pyramid(layout, jnp.concatenate([maps.base_color, own], axis=-1))
    x, y, z = means[:, 5], means[:, 6], jnp.maximum(means[:, 7], LEAST_HEIGHT)
    about_mean = means[:, 8:] - jnp.stack([x * x, y * y, x * y], axis=1)
    return jnp.concatenate([(x / z)[:, None], (y / z)[:, None], means[:, :5], about_mean], axis=1)
