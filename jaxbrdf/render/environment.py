"""Light from all around as an equirectangular image, with a density to sample it by.

The image's first row is the zenith (+y). With u from left to right and v from top to bottom, both in [0, 1], a texel at
(u, v) shines from (sin t sin p, cos t, -sin t cos p), t = pi v, p = 2 pi u: the middle of the image lies behind the
viewer, at +z. Radiance is interpolated bilinearly between texel centres, around the seam too.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.colour import REC709_LUMINANCE
from jaxbrdf.core.numerics import safe_atan2, safe_divide
from jaxbrdf.sampling.tabulated import Tabulated, sample_tabulated, tabulate, tabulated_density


class Environment(NamedTuple):
    """radiance: linear Rec.709, `(H, W, 3)`. table: density of brightness over the unit square."""

    radiance: jax.Array
    table: Tabulated


class LightSample(NamedTuple):
    """World direction to the light `(..., 3)`, its radiance `(..., 3)` and its density per solid angle `(...)`."""

    direction: jax.Array
    radiance: jax.Array
    density: jax.Array


def make_environment(radiance: np.ndarray) -> Environment:
    """An environment of an image `(H, W, 3)`.

    Raises:
        ValueError: an image of another shape, with negative or non-finite values, or black.
    """
    radiance = np.asarray(radiance, np.float32)
    if radiance.ndim != 3 or radiance.shape[-1] != 3 or radiance.size == 0:
        raise ValueError(f"environment has shape {radiance.shape}; it must be (H, W, 3)")
    if not np.all(np.isfinite(radiance)) or np.any(radiance < 0):
        raise ValueError("environment has negative or non-finite radiance; it must be finite and at least zero")
    if not radiance.any():
        raise ValueError("environment is black; some radiance must be positive")
    return Environment(jnp.asarray(radiance), tabulate(_brightness(radiance)))


def look_up(environment: Environment, direction: jax.Array) -> jax.Array:
    """Radiance from world directions, `(..., 3)` to `(..., 3)`."""
    return _interpolate(environment.radiance, direction_to_square(direction))


def sample_light(environment: Environment, u: jax.Array) -> LightSample:
    """Directions drawn by brightness from u `(..., 2)`."""
    draw = sample_tabulated(environment.table, u)
    direction = square_to_direction(draw.point)
    density = _per_solid_angle(draw.density, direction)
    return LightSample(direction, _interpolate(environment.radiance, draw.point), density)


def light_density(environment: Environment, direction: jax.Array) -> jax.Array:
    """Density per solid angle of `sample_light` at world directions."""
    return _per_solid_angle(tabulated_density(environment.table, direction_to_square(direction)), direction)


def direction_to_square(w: jax.Array) -> jax.Array:
    """World direction to (u, v), `(..., 2)`."""
    u = safe_atan2(w[..., 0], -w[..., 2]) / (2.0 * jnp.pi)
    # not acos(y), which loses half of its digits next to the poles
    v = safe_atan2(jnp.hypot(w[..., 0], w[..., 2]), w[..., 1]) / jnp.pi
    return jnp.stack([u - jnp.floor(u), v], axis=-1)


def square_to_direction(point: jax.Array) -> jax.Array:
    """(u, v) to a world direction, `(..., 3)`."""
    phi, theta = 2.0 * jnp.pi * point[..., 0], jnp.pi * point[..., 1]
    sin = jnp.sin(theta)
    return jnp.stack([sin * jnp.sin(phi), jnp.cos(theta), -sin * jnp.cos(phi)], axis=-1)


def _per_solid_angle(density: jax.Array, w: jax.Array) -> jax.Array:
    """Density over (u, v) divided by d omega / d(u, v) = 2 pi^2 sin t."""
    return safe_divide(density, 2.0 * jnp.pi**2 * jnp.hypot(w[..., 0], w[..., 2]))


def _brightness(radiance: np.ndarray) -> np.ndarray:
    """What each texel's area sends: luminance of the interpolant's mean over it, times its solid angle.

    The bilinear interpolant's mean over one texel weighs neighbours 1 : 6 : 1, so no lit spot has density zero.
    """
    luminance = radiance.astype(np.float64) @ np.array(REC709_LUMINANCE)
    across = (np.roll(luminance, 1, 1) + 6.0 * luminance + np.roll(luminance, -1, 1)) / 8.0
    padded = np.pad(across, ((1, 1), (0, 0)), mode="edge")
    mean = (padded[:-2] + 6.0 * across + padded[2:]) / 8.0
    edges = np.cos(np.linspace(0.0, np.pi, len(radiance) + 1))
    return mean * (edges[:-1] - edges[1:])[:, None]


def _interpolate(image: jax.Array, point: jax.Array) -> jax.Array:
    """Bilinear value at (u, v): columns wrap, rows stop at the poles."""
    height, width, _ = image.shape
    x, y = point[..., 0] * width - 0.5, point[..., 1] * height - 0.5
    column, row = jnp.floor(x), jnp.floor(y)
    right, down = (x - column)[..., None], (y - row)[..., None]
    left, column = jnp.mod(column, width).astype(jnp.int32), jnp.mod(column + 1, width).astype(jnp.int32)
    top, bottom = (jnp.clip(row + i, 0, height - 1).astype(jnp.int32) for i in (0, 1))
    upper = image[top, left] * (1.0 - right) + image[top, column] * right
    lower = image[bottom, left] * (1.0 - right) + image[bottom, column] * right
    return upper * (1.0 - down) + lower * down
