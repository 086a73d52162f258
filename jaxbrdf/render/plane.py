"""An endless textured plane seen by a pinhole camera, with the footprint that every pixel has on it.

The plane's frame is z out of it, x along u and y up the texture, against v (docs/conventions.md); in the world of the
environment maps it is a floor, whose texture's upper edge points away from the viewer, to -z.

A film point (a, b), to the right and up at distance one from the pinhole, is seen through the ray d + a r + b u. With
the camera at distance D from the point in the middle of the picture, slanted by theta, the ray comes down by
s = cos(theta) - b sin(theta), and meets the plane, counted from that point,

    D a cos(theta) / s to the right and D b / s forwards.

Neither form cancels, however far the camera stands. A pixel's reconstruction filter is a Gaussian of deviation 1/2
pixel, which is the unit filter stretched to pixels: the columns of the footprint are the derivatives by a and b times a
pixel's step (Heckbert 1989). It is exact where the ray's slant does not change over a pixel, and off within a few
pixels of the horizon, where a pixel's share of the plane is no ellipse.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.smith import LEAST_COSINE
from jaxbrdf.render.shading import Place, Shading

FLOOR = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
"""The plane's frame in the world (x right, y up, z to the viewer): rows tangent, bitangent and normal."""

FARTHEST = 2.0**40
"""Periods between camera and plane. A footprint is then at most 2^40 / `LEAST_COSINE`^2 = 2^88 steps of a pixel, each
below 2^5: far below float32's largest number, 2^128."""

WIDEST = 170.0
"""Degrees of the field of view: a pixel's step is at most 2 tan(85) = 23."""


@dataclass(frozen=True)
class PlaneView:
    """A camera over the plane.

    Attributes:
        distance: to the point in the middle of the picture, in world units.
        slant: of the camera from the plane's normal, degrees.
        azimuth: by which the camera is turned about the normal, counterclockwise, degrees; at zero it stands below the
            texture, and the picture's rows run along u.
        field_of_view: across the picture's shorter side, degrees.
        centre: uv in the middle of the picture.
        period: of the texture, in world units.
        height, width: pixels.

    Raises:
        ValueError: a value out of its range.
    """

    distance: float = 2.0
    slant: float = 0.0
    azimuth: float = 0.0
    field_of_view: float = 40.0
    centre: tuple[float, float] = (0.5, 0.5)
    period: float = 1.0
    height: int = 256
    width: int = 256

    def __post_init__(self) -> None:
        if not (self.distance > 0 and self.period > 0 and self.distance / self.period <= FARTHEST):
            raise ValueError(
                f"distance is {self.distance} and period {self.period}; both must be positive, and at most "
                f"{FARTHEST:g} periods lie between camera and plane"
            )
        if not 0 <= self.slant < 90:
            raise ValueError(f"slant is {self.slant}; it must be at least 0 and below 90 degrees")
        if not 0 < self.field_of_view <= WIDEST:
            raise ValueError(f"field_of_view is {self.field_of_view}; it must be above 0 and at most {WIDEST} degrees")
        if not all(map(math.isfinite, (self.azimuth, *self.centre))):
            raise ValueError(f"azimuth is {self.azimuth} and centre {self.centre}; they must be finite")
        if min(self.height, self.width) < 1:
            raise ValueError(f"the picture is {self.height} x {self.width}; it must have at least one pixel a side")

    @property
    def step(self) -> float:
        """A pixel's side on the film at distance one."""
        return 2.0 * math.tan(math.radians(self.field_of_view) / 2.0) / min(self.height, self.width)


class PlaneCamera(NamedTuple):
    """The numbers of a view, float32, which compiled code takes as arguments.

    Attributes:
        distance: in periods.
        slant, azimuth: cosine and sine, `(2,)`.
        step: a pixel's side on the film.
        centre: uv, `(2,)`.
    """

    distance: jax.Array
    slant: jax.Array
    azimuth: jax.Array
    step: jax.Array
    centre: jax.Array


def camera_of(view: PlaneView) -> PlaneCamera:
    """The camera of a view."""
    slant, azimuth = (np.radians(angle) for angle in (view.slant, view.azimuth))
    numbers = (
        view.distance / view.period,
        (np.cos(slant), np.sin(slant)),
        (np.cos(azimuth), np.sin(azimuth)),
        view.step,
        view.centre,
    )
    return PlaneCamera(*(jnp.asarray(number, jnp.float32) for number in numbers))


def see(camera: PlaneCamera, pixel: jax.Array, size: tuple[int, int]) -> Shading:
    """The plane through the middles of pixels of flat indices `(n,)` in a picture of `size` (height, width).

    A ray misses when it does not come down by at least `LEAST_COSINE` of its length, from where on rounding decides
    whether it comes down at all; what misses gets the place in the middle of the picture.
    """
    (height, width), (cos, sin) = size, camera.slant
    a = (pixel % width + 0.5 - 0.5 * width) * camera.step
    b = (0.5 * height - pixel // width - 0.5) * camera.step
    hit = cos - b * sin > LEAST_COSINE * jnp.sqrt(1.0 + a * a + b * b)
    a, b = jnp.where(hit, a, 0.0), jnp.where(hit, b, 0.0)
    down = cos - b * sin
    wo = jnp.stack([-a, -(sin + b * cos), down], axis=-1) / jnp.sqrt(1.0 + a * a + b * b)[..., None]
    met = jnp.stack([a * cos, b], axis=-1) * (camera.distance / down)[..., None]
    footprint = _footprint(camera, a, down)
    place = Place(
        jnp.concatenate([_turned(camera, wo[..., :2]), wo[..., 2:]], axis=-1),
        camera.centre[None, :] + _to_uv(_turned(camera, met)),
        _to_uv(_turned(camera, footprint.swapaxes(-1, -2))).swapaxes(-1, -2),
    )
    return Shading(hit, jnp.broadcast_to(jnp.asarray(FLOOR), (*hit.shape, 3, 3)), place)


def _footprint(camera: PlaneCamera, a: jax.Array, down: jax.Array) -> jax.Array:
    """Change of the point on the plane, right and forwards, a pixel to the right and a pixel up, `(n, 2, 2)`.

    Of a cos / s and b / s with s = cos - b sin: the derivatives by b are a cos sin / s^2 and cos / s^2.
    """
    cos, sin = camera.slant
    reach = camera.distance * camera.step * cos / down
    rows = [jnp.stack([reach, reach * a * sin / down], axis=-1), jnp.stack([0.0 * reach, reach / down], axis=-1)]
    return jnp.stack(rows, axis=-2)


def _turned(camera: PlaneCamera, v: jax.Array) -> jax.Array:
    """Vectors `(..., 2)`, right and forwards, in the plane's x and y."""
    cos, sin = camera.azimuth
    return jnp.stack([cos * v[..., 0] - sin * v[..., 1], sin * v[..., 0] + cos * v[..., 1]], axis=-1)


def _to_uv(v: jax.Array) -> jax.Array:
    """Vectors of the plane in texture coordinates: v runs down the rows, against y."""
    return jnp.stack([v[..., 0], -v[..., 1]], axis=-1)
