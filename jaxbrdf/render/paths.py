"""Ways of light to a picture's pixels, drawn once by one material and scattered by any.

Each sample draws one direction by the light and one by the material, both weighed by the power heuristic (Veach and
Guibas 1995). Pictures of two materials by the same paths differ by the materials alone: they share their noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.render.camera import film_points
from jaxbrdf.render.environment import Environment, light_density, look_up, sample_light
from jaxbrdf.render.film import CHUNK, pixels_of_the_sphere, to_image
from jaxbrdf.render.proposal import with_sampler
from jaxbrdf.render.shading import Place, Shading, query_of, to_local, to_world
from jaxbrdf.render.sphere import intersect
from jaxbrdf.sampling.mis import power_heuristic
from jaxbrdf.sampling.sobol import rotate, sobol_points
from jaxbrdf.types import Brdf, Material, Params

DIMENSIONS = 5
"""Random numbers a sample takes: lobe and direction of the material, direction of the light, place in the pixel."""


class Ways(NamedTuple):
    """Two directions to the light, the first drawn by it and the second by a material.

    Attributes:
        place: of the surface, with wo `(n, 3)` to the viewer.
        wi: to the light, `(2, n, 3)`.
        gain: radiance that reaches the viewer for f = 1, linear Rec.709, `(2, n, 3)`; zero where there is no surface.
    """

    place: Place
    wi: jax.Array
    gain: jax.Array


class Paths(NamedTuple):
    """All ways of light to some pixels.

    Attributes:
        pixels: flat indices, `(CHUNK,)`.
        ways: of each sample, `(samples, ...)`.
    """

    pixels: np.ndarray
    ways: Ways


def draw_paths(
    key: jax.Array, material: Material, environment: Environment, *, height: int, width: int, samples: int
) -> Iterator[Paths]:
    """The ways by which `render_environment` renders the material, chunk by chunk: 60 bytes a sample of a pixel.

    Args:
        key: shifts each pixel's samples.
        material: draws; one without a sampler is given general proposals.
        environment: the light.
        height, width: pixels.
        samples: draws a pixel.
    """
    points = jnp.asarray(sobol_points(samples, DIMENSIONS))
    for index, pixels in enumerate(pixels_of_the_sphere(height, width)):
        chunk_key = jax.random.fold_in(key, index)
        ways = _draw(
            material.brdf, (height, width), chunk_key, jnp.asarray(pixels), points, material.params, environment
        )
        yield Paths(pixels, ways)


def pictures_by(
    paths: Iterable[Paths], materials: Mapping[str, Material], *, height: int, width: int
) -> dict[str, np.ndarray]:
    """Each material on the sphere by the same paths, `(height, width, 3)` float32, black around it."""
    pixels, colours = [], {name: [] for name in materials}
    for chunk in paths:
        pixels.append(chunk.pixels)
        for name, material in materials.items():
            colours[name].append(np.asarray(_scatter(material.brdf, material.params, chunk.ways)))
    return {name: to_image(np.concatenate(pixels), np.concatenate(of), height, width) for name, of in colours.items()}


def draw_ways(brdf: Brdf, params: Params, environment: Environment, shading: Shading, u: jax.Array) -> Ways:
    """One direction by the light and one by the material at each point of the surface, `u` of shape `(n, 5)`."""
    sampler, place = sampler_of(with_sampler(brdf)), shading.place
    light = sample_light(environment, u[..., :2])
    to_light = to_local(shading.frame, light.direction)
    by_light = power_heuristic(light.density, sampler.pdf(params, query_of(place, to_light)))
    drawn = sampler.sample(params, query_of(place, place.wo), u[..., jnp.array([2, 0, 1])])
    direction = to_world(shading.frame, drawn.wi)
    by_material = power_heuristic(drawn.pdf, light_density(environment, direction))
    wi = jnp.stack([to_light, drawn.wi])
    share = safe_divide(jnp.stack([by_light, by_material]), jnp.stack([light.density, drawn.pdf]))
    gain = jnp.where(shading.hit[None], share * jnp.maximum(cos_theta(wi), 0.0), 0.0)
    radiance = jnp.stack([light.radiance, look_up(environment, direction)])
    return Ways(place, wi, gain[..., None] * radiance)


def scattered(brdf: Brdf, params: Params, ways: Ways) -> jax.Array:
    """Radiance to the viewer, `(n, 3)`."""
    return jnp.sum(brdf.eval(params, query_of(ways.place, ways.wi)) * ways.gain, axis=0)


def shade(pixel: jax.Array, u: jax.Array, size: tuple[int, int]) -> Shading:
    """What each pixel `(n,)` sees: the first dimensions, the most even, choose directions, the last two the place."""
    return intersect(film_points(pixel, u[:, 3:], *size))


@partial(jax.jit, static_argnums=(0, 1))
def _draw(
    brdf: Brdf,
    size: tuple[int, int],
    key: jax.Array,
    pixels: jax.Array,
    points: jax.Array,
    params: Params,
    environment: Environment,
) -> Ways:
    shift = jax.random.uniform(key, (CHUNK, DIMENSIONS))

    def draw(point: jax.Array) -> Ways:
        u = rotate(point[None, :], shift)
        return draw_ways(brdf, params, environment, shade(pixels, u, size), u)

    return jax.lax.map(draw, points)


@partial(jax.jit, static_argnums=0)
def _scatter(brdf: Brdf, params: Params, ways: Ways) -> jax.Array:
    """The mean over samples, `(CHUNK, 3)`."""

    def add_sample(total: jax.Array, way: Ways) -> tuple[jax.Array, None]:
        return total + scattered(brdf, params, way), None

    total, _ = jax.lax.scan(add_sample, jnp.zeros((CHUNK, 3)), ways)
    return total / len(ways.gain)
