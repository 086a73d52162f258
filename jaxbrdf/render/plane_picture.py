"""Pictures of a textured plane, under a directional light or an environment.

The light of a pixel is the mean of what its footprint scatters, and is taken in the texture, at the one direction of
view of the pixel's middle ("quasi ground truth" of Timonen et al., section 6): either by the material itself, which is
given footprints, or, for a material at points, over random points of each footprint (`jaxbrdf.surface.prefilter`).
Pictures are linear Rec.709 radiance, rows from the top; where the plane is not seen they are black.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.directions import cos_theta
from jaxbrdf.render.environment import Environment
from jaxbrdf.render.film import all_pixels, to_image
from jaxbrdf.render.paths import DIMENSIONS, draw_ways, scattered
from jaxbrdf.render.plane import PlaneCamera, PlaneView, camera_of, see
from jaxbrdf.render.shading import Place, Shading, query_of
from jaxbrdf.sampling.sobol import rotate, sobol_points
from jaxbrdf.surface.prefilter import gaussian_point, prefiltered, query_at
from jaxbrdf.types import Brdf, Material, Params, Query


def plane_directional(
    key: jax.Array,
    material: Material,
    view: PlaneView,
    direction: tuple[float, float, float],
    *,
    irradiance: tuple[float, float, float] = (np.pi, np.pi, np.pi),
    samples: int | None = None,
) -> np.ndarray:
    """The plane under light from one direction, `(height, width, 3)` float32: f cos(wi) times the irradiance.

    Args:
        key: shifts the points of each pixel's footprint.
        material: only its eval is used.
        view: of the camera.
        direction: to the light, in the plane's frame; need not be of unit length.
        irradiance: on a surface that faces the light, linear Rec.709; pi makes a white Lambert plane one at its best.
        samples: points of each footprint for a material at points; None for one that is given footprints.
    """
    towards = np.asarray(direction, np.float64) / np.linalg.norm(direction)
    size, pixels = (view.height, view.width), all_pixels(view.height, view.width)
    light = (jnp.asarray(towards, jnp.float32), jnp.asarray(irradiance, jnp.float32))
    colours = _light_chunks(
        material.brdf.eval, samples, size, key, camera_of(view), jnp.asarray(pixels), material.params, light
    )
    return to_image(pixels, np.asarray(colours), *size)


def plane_environment(
    key: jax.Array,
    material: Material,
    view: PlaneView,
    environment: Environment,
    *,
    samples: int = 64,
    at_points: bool = True,
) -> np.ndarray:
    """The plane, a floor in an environment, `(height, width, 3)` float32.

    Args:
        key: shifts each pixel's samples.
        material: any; one without a sampler is given general proposals.
        view: of the camera.
        environment: the light.
        samples: draws a pixel, of two directions each.
        at_points: whether the material is one at points, which every draw has another of; otherwise it is given
            footprints.
    """
    size, pixels = (view.height, view.width), all_pixels(view.height, view.width)
    points = jnp.asarray(sobol_points(samples, DIMENSIONS))
    colours = _environment_chunks(
        material.brdf, at_points, size, key, camera_of(view), jnp.asarray(pixels), points, material.params, environment
    )
    return to_image(pixels, np.asarray(colours), *size)


def _estimator(
    evaluate: Callable[[Params, Query], jax.Array], samples: int | None
) -> Callable[[jax.Array, Params, Query], jax.Array]:
    if samples is not None:
        return prefiltered(evaluate, samples=samples)
    return lambda key, params, query: evaluate(params, query)


@partial(jax.jit, static_argnums=(0, 1, 2))
def _light_chunks(
    evaluate: Callable[[Params, Query], jax.Array],
    samples: int | None,
    size: tuple[int, int],
    key: jax.Array,
    camera: PlaneCamera,
    pixels: jax.Array,
    params: Params,
    light: tuple[jax.Array, jax.Array],
) -> jax.Array:
    (towards, irradiance), estimate = light, _estimator(evaluate, samples)

    def chunk(index: jax.Array, pixel: jax.Array) -> jax.Array:
        shading = see(camera, pixel, size)
        wi = jnp.broadcast_to(towards, shading.place.wo.shape)
        f = estimate(jax.random.fold_in(key, index), params, query_of(shading.place, wi))
        lit = f * jnp.maximum(cos_theta(wi), 0.0)[..., None] * irradiance[None, :]
        return jnp.where(shading.hit[..., None], lit, 0.0)

    return jax.lax.map(lambda c: chunk(*c), (jnp.arange(len(pixels)), pixels)).reshape(-1, 3)


@partial(jax.jit, static_argnums=(0, 1, 2))
def _environment_chunks(
    brdf: Brdf,
    at_points: bool,
    size: tuple[int, int],
    key: jax.Array,
    camera: PlaneCamera,
    pixels: jax.Array,
    points: jax.Array,
    params: Params,
    environment: Environment,
) -> jax.Array:
    def chunk(index: jax.Array, pixel: jax.Array) -> jax.Array:
        shading = see(camera, pixel, size)
        shift = jax.random.uniform(jax.random.fold_in(key, index), (len(pixel), DIMENSIONS))

        def add_sample(i: jax.Array, total: jax.Array) -> jax.Array:
            u = rotate(points[i][None, :], shift)
            seen = _at_point(shading, u[:, 3:]) if at_points else shading
            return total + scattered(brdf, params, draw_ways(brdf, params, environment, seen, u))

        return jax.lax.fori_loop(0, len(points), add_sample, jnp.zeros((len(pixel), 3))) / len(points)

    return jax.lax.map(lambda c: chunk(*c), (jnp.arange(len(pixels)), pixels)).reshape(-1, 3)


def _at_point(shading: Shading, u: jax.Array) -> Shading:
    """A random point of each footprint, by u `(n, 2)`."""
    moved = query_at(query_of(shading.place, shading.place.wo), gaussian_point(u))
    return shading._replace(place=Place(moved.wo, moved.uv))
