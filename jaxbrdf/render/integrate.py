"""A sphere of one material, under an environment or a directional light.

Under an environment every sample draws two directions (`jaxbrdf.render.paths`). Under a directional light the picture
has no noise: the only average is over a fixed grid of points in each pixel. Both return linear Rec.709 radiance, rows
from the top.
"""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.directions import cos_theta
from jaxbrdf.render.camera import film_points
from jaxbrdf.render.environment import Environment
from jaxbrdf.render.film import CHUNK, pixels_of_the_sphere, to_image
from jaxbrdf.render.paths import DIMENSIONS, draw_ways, scattered, shade
from jaxbrdf.render.shading import Shading, query_of, to_local
from jaxbrdf.render.sphere import intersect
from jaxbrdf.sampling.sobol import rotate, sobol_points
from jaxbrdf.types import Brdf, Material, Params


def render_environment(
    key: jax.Array,
    material: Material,
    environment: Environment,
    *,
    height: int = 256,
    width: int = 256,
    samples: int = 64,
) -> np.ndarray:
    """The sphere under an environment, `(height, width, 3)` float32, black around it.

    Args:
        key: shifts each pixel's samples; the same key gives two materials the same light directions.
        material: any; one without a sampler is given general proposals.
        environment: the light.
        height, width: pixels.
        samples: draws a pixel; each evaluates the material twice.
    """
    pixels = pixels_of_the_sphere(height, width)
    points = jnp.asarray(sobol_points(samples, DIMENSIONS))
    colours = _render_chunks(
        material.brdf, (height, width), key, jnp.asarray(pixels), points, material.params, environment
    )
    return to_image(pixels, np.asarray(colours), height, width)


def render_directional(
    material: Material,
    direction: tuple[float, float, float],
    *,
    irradiance: tuple[float, float, float] = (np.pi, np.pi, np.pi),
    height: int = 256,
    width: int = 256,
    grid: int = 4,
) -> np.ndarray:
    """The sphere under light from one direction, `(height, width, 3)` float32, black around it.

    Args:
        material: any; only its eval is used.
        direction: to the light, in the world (x right, y up, z to the viewer); need not be of unit length.
        irradiance: on a surface that faces the light, linear Rec.709; pi makes a white Lambert sphere one at its best.
        height, width: pixels.
        grid: points along each side of a pixel.
    """
    towards = np.asarray(direction, np.float32) / np.float32(np.linalg.norm(direction))
    pixels = pixels_of_the_sphere(height, width)
    light = (jnp.asarray(towards), jnp.asarray(irradiance, jnp.float32))
    colours = _light_chunks(material.brdf, (height, width), grid, jnp.asarray(pixels), material.params, light)
    return to_image(pixels, np.asarray(colours), height, width)


@partial(jax.jit, static_argnums=(0, 1))
def _render_chunks(
    brdf: Brdf,
    size: tuple[int, int],
    key: jax.Array,
    pixels: jax.Array,
    points: jax.Array,
    params: Params,
    environment: Environment,
) -> jax.Array:
    def chunk(index: jax.Array, pixel: jax.Array) -> jax.Array:
        shift = jax.random.uniform(jax.random.fold_in(key, index), (CHUNK, points.shape[1]))

        def add_sample(i: jax.Array, total: jax.Array) -> jax.Array:
            u = rotate(points[i][None, :], shift)
            ways = draw_ways(brdf, params, environment, shade(pixel, u, size), u)
            return total + scattered(brdf, params, ways)

        return jax.lax.fori_loop(0, len(points), add_sample, jnp.zeros((CHUNK, 3))) / len(points)

    return jax.lax.map(lambda c: chunk(*c), (jnp.arange(len(pixels)), pixels)).reshape(-1, 3)


@partial(jax.jit, static_argnums=(0, 1, 2))
def _light_chunks(
    brdf: Brdf,
    size: tuple[int, int],
    grid: int,
    pixels: jax.Array,
    params: Params,
    light: tuple[jax.Array, jax.Array],
) -> jax.Array:
    towards, irradiance = light

    def chunk(pixel: jax.Array) -> jax.Array:
        def add_point(i: jax.Array, total: jax.Array) -> jax.Array:
            offset = (jnp.stack([i % grid, i // grid]) + 0.5) / grid
            shading = intersect(film_points(pixel, jnp.broadcast_to(offset, (CHUNK, 2)), *size))
            wi = to_local(shading.frame, jnp.broadcast_to(towards, (CHUNK, 3)))
            return total + _scattered(brdf, params, shading, wi) * irradiance[None, :]

        return jax.lax.fori_loop(0, grid * grid, add_point, jnp.zeros((CHUNK, 3))) / (grid * grid)

    return jax.lax.map(chunk, pixels).reshape(-1, 3)


def _scattered(brdf: Brdf, params: Params, shading: Shading, wi: jax.Array) -> jax.Array:
    """f cos(wi) where there is a surface, `(n, 3)`."""
    f = brdf.eval(params, query_of(shading.place, wi))
    return jnp.where(shading.hit[..., None], f * jnp.maximum(cos_theta(wi), 0.0)[..., None], 0.0)
