"""Measured materials in the adaptive parameterisation of Dupuy and Jakob (2018).

The viewer (our wo) fixes a slice of the tables. The microfacet normal m half way between the directions gives a point
u_m = (sqrt(2 theta_m / pi), phi_m / 2pi + 1/2) of the unit square, and the inverse of the warp `vndf` takes that to the
place where the reflectance is stored:

    f cos(wi) = max(rgb(invert(u_m)), 0) ndf(u_m) / (4 sigma(u_o))

The same warps, forwards, draw wi. The roles are those of Mitsuba's `measured` with its si.wi as our wo.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf import tabulated_warp
from jaxbrdf.brdf.tabulated_warp import Point, Slices, Warp
from jaxbrdf.core.arctangent import fast_atan2
from jaxbrdf.core.directions import above_horizon, cos_theta, dot, half_vector, reflect, sin_theta, spherical
from jaxbrdf.core.numerics import safe_divide, safe_sqrt
from jaxbrdf.core.staging import staged
from jaxbrdf.data.rgl import Rgl
from jaxbrdf.types import Brdf, Material, Query, Sample

LEAST_JACOBIAN = 1e-6
"""Floor of 2 pi^2 u_m sin(theta_m), which vanishes at the pole: a finite density there (Mitsuba's value)."""


@dataclass(frozen=True)
class Layout:
    """What a file's tables depend on; fixed when a function is compiled.

    Attributes:
        isotropic: azimuths count from the viewer's.
        sectors: how many equal sectors the viewer's azimuth has: 1, 2 (turned by pi) or 4 (mirrored, too).
        jacobian: whether the reflectance is multiplied by ndf / (4 sigma).
    """

    isotropic: bool
    sectors: int
    jacobian: bool


class RglParams(NamedTuple):
    """Tables of one material: P azimuths and T elevations of the viewer, S = P T slices.

    Attributes:
        phi: the viewer's azimuths, `(P,)`.
        theta: the viewer's elevations, `(T,)`.
        ndf: `(1, H, W, 1)`, with H = 1 where it does not depend on the azimuth.
        sigma: `(1, H, W, 1)`, likewise.
        vndf: warp of the visible normals.
        luminance: warp of the light, in the square that `vndf` comes from.
        rgb: `(S, h, w, 3)`.
    """

    phi: jax.Array
    theta: jax.Array
    ndf: jax.Array
    sigma: jax.Array
    vndf: Warp
    luminance: Warp
    rgb: jax.Array


class Viewer(NamedTuple):
    """The viewer's slices, its point in the square of `sigma`, and the azimuth that normals count from, as (x, y)."""

    slices: Slices
    point: Point
    forward: tuple[jax.Array, jax.Array]


def layout(data: Rgl) -> Layout:
    """The layout of a file's arrays; the sectors follow from the range of its azimuths."""
    if data.isotropic:
        return Layout(True, 1, data.jacobian)
    sectors = 2.0 * np.pi / float(data.phi_i[-1] - data.phi_i[0])
    return Layout(False, next((n for n in (2, 4) if abs(sectors - n) < 0.5), 1), data.jacobian)


def params(data: Rgl) -> RglParams:
    """The tables with their integrals, computed once."""
    count = len(data.phi_i) * len(data.theta_i)
    return RglParams(
        phi=jnp.asarray(data.phi_i),
        theta=jnp.asarray(data.theta_i),
        ndf=_map(data.ndf),
        sigma=_map(data.sigma),
        vndf=tabulated_warp.warp(data.vndf.reshape(count, *data.vndf.shape[2:])),
        luminance=tabulated_warp.warp(data.luminance.reshape(count, *data.luminance.shape[2:])),
        rgb=jnp.asarray(np.moveaxis(data.rgb, 2, -1).reshape(count, *data.rgb.shape[3:], 3)),
    )


def _map(table: np.ndarray) -> jax.Array:
    """A table `(H, W)` as one slice, without the azimuth where all rows are the same."""
    return jnp.asarray((table[:1] if np.all(table == table[:1]) else table)[None, ..., None])


@cache
def brdf(config: Layout) -> Brdf:
    """The pure functions for tables of this layout; the same ones each time, so that files share what is compiled."""
    return Brdf(eval=partial(evaluate, config), sample=partial(sample, config), pdf=partial(pdf, config))


def material(data: Rgl, name: str) -> Material:
    """A file's arrays as a material."""
    return Material(name, brdf(layout(data)), params(data), data.isotropic)


def evaluate(config: Layout, tables: RglParams, query: Query) -> jax.Array:
    """f(wi, wo), `(..., 3)` in 1/sr; values that interpolate to less than zero become zero."""
    return jnp.maximum(unclamped(config, tables, query), 0.0)


def unclamped(config: Layout, tables: RglParams, query: Query) -> jax.Array:
    """f(wi, wo) as interpolated, `(..., 3)`: measurement noise makes some of it negative. Zero below the horizon."""
    wi, wo = _fold(config, query.wi, query.wo), _fold(config, query.wo, query.wo)
    viewer = _viewer(config, tables, wo)
    point, _ = _normal_to_point(wi + wo, viewer)
    viewer, point = staged((viewer, point))
    place = staged(tabulated_warp.invert(tables.vndf, viewer.slices, point)[0])
    per_cosine = safe_divide(_scale(config, tables, viewer, point), cos_theta(wi))
    scale = jnp.where(above_horizon(wi, wo), per_cosine, 0.0)
    return _scaled_rgb(tables, viewer, place, scale)


def pdf(config: Layout, tables: RglParams, query: Query) -> jax.Array:
    """Density of `sample` at wi for the viewer wo, per solid angle, `(...)`; zero below the horizon."""
    wi, wo = _fold(config, query.wi, query.wo), _fold(config, query.wo, query.wo)
    viewer = _viewer(config, tables, wo)
    m = half_vector(wi, wo)
    point, sine = _normal_to_point(m, viewer)
    viewer, point = staged((viewer, point))
    place, density = staged(tabulated_warp.invert(tables.vndf, viewer.slices, point))
    light = tabulated_warp.density(tables.luminance, viewer.slices, place)
    value = safe_divide(density * light, _solid_angle(point, sine, dot(wo, m)))
    return jnp.where(above_horizon(wi, wo), value, 0.0)


def sample(config: Layout, tables: RglParams, query: Query, u: jax.Array) -> Sample:
    """A direction to the light for the viewer `query.wo`; u[1:3] choose it, u[0] is not used.

    Directions that the mirror sends below the horizon are returned with their density and weight zero.
    """
    wo = _fold(config, query.wo, query.wo)
    viewer = staged(_viewer(config, tables, wo))
    place, light = staged(tabulated_warp.sample(tables.luminance, viewer.slices, Point(u[..., 2], u[..., 1])))
    point, density = staged(tabulated_warp.sample(tables.vndf, viewer.slices, place))
    m, sine = _point_to_normal(point, viewer)
    wi = reflect(wo, m)
    chosen = safe_divide(density * light, _solid_angle(point, sine, dot(wo, m)))
    per_density = safe_divide(_scale(config, tables, viewer, point), chosen)
    scale = jnp.where(above_horizon(wi, wo), per_density, 0.0)
    weight = jnp.maximum(_scaled_rgb(tables, viewer, place, scale), 0.0)
    return Sample(_fold(config, wi, query.wo), jnp.where(cos_theta(wo) > 0, chosen, 0.0), weight)


def _scale(config: Layout, tables: RglParams, viewer: Viewer, point: Point) -> jax.Array:
    """ndf / (4 sigma), `(...)`: what the tables' reflectance is multiplied by to give f cos(wi)."""
    if not config.jacobian:
        return jnp.ones_like(point.x)
    only = tabulated_warp.one_slice(point.x.shape)
    ndf = tabulated_warp.interpolate(tables.ndf, only, point)[..., 0]
    return safe_divide(ndf, 4.0 * tabulated_warp.interpolate(tables.sigma, only, viewer.point)[..., 0])


def _scaled_rgb(tables: RglParams, viewer: Viewer, place: Point, scale: jax.Array) -> jax.Array:
    """The tables' reflectance at a place, times `scale`, `(..., 3)`."""
    return tabulated_warp.interpolate(tables.rgb, viewer.slices, place) * scale[..., None]


def _fold(config: Layout, w: jax.Array, wo: jax.Array) -> jax.Array:
    """w under the symmetry that takes wo to negative y (and, with four sectors, negative x); its own inverse.

    Signs rather than comparisons: wo on the x axis must come out with y = -0, whose azimuth is -pi, the tables' first.
    """
    if config.sectors == 1:
        return w
    y = -jnp.copysign(1.0, wo[..., 1])
    x = -jnp.copysign(1.0, wo[..., 0]) if config.sectors == 4 else y
    return w * jnp.stack([x, y, jnp.ones_like(x)], axis=-1)


def _viewer(config: Layout, tables: RglParams, wo: jax.Array) -> Viewer:
    sine = sin_theta(wo)
    theta = fast_atan2(sine, cos_theta(wo))
    phi = fast_atan2(wo[..., 1], wo[..., 0])
    where = tabulated_warp.slices(phi, theta, (tables.phi, tables.theta))
    return Viewer(where, _to_square(theta, phi), _forward(config, wo, sine))


def _forward(config: Layout, wo: jax.Array, sine: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The direction in the plane that has azimuth zero: the viewer's, or x where there is none to tell."""
    if not config.isotropic:
        return jnp.ones_like(sine), jnp.zeros_like(sine)
    return jnp.where(sine > 0, wo[..., 0], 1.0), jnp.where(sine > 0, wo[..., 1], 0.0)


def _to_square(theta: jax.Array, phi: jax.Array) -> Point:
    """The point of the unit square that stands for elevation theta and azimuth phi in [-pi, pi]."""
    return Point(safe_sqrt(theta * (2.0 / jnp.pi)), phi * (0.5 / jnp.pi) + 0.5)


def _normal_to_point(m: jax.Array, viewer: Viewer) -> tuple[Point, jax.Array]:
    """The point in the square of `vndf` of a normal of any length, and the sine of its elevation times its length."""
    x, y = viewer.forward
    sine = sin_theta(m)
    phi = fast_atan2(x * m[..., 1] - y * m[..., 0], x * m[..., 0] + y * m[..., 1])
    return _to_square(fast_atan2(sine, cos_theta(m)), phi), sine


def _point_to_normal(point: Point, viewer: Viewer) -> tuple[jax.Array, jax.Array]:
    """Inverse of `_normal_to_point`."""
    theta = point.x * point.x * (0.5 * jnp.pi)
    x, y = viewer.forward
    phi = (2.0 * point.y - 1.0) * jnp.pi + fast_atan2(y, x)
    return spherical(theta, phi), jnp.sin(theta)


def _solid_angle(point: Point, sine: jax.Array, cos_d: jax.Array) -> jax.Array:
    """Solid angle of wi for a unit of the square: 2 pi^2 u_m sin(theta_m) 4 |wo . m|."""
    return jnp.maximum(2.0 * jnp.pi**2 * point.x * sine, LEAST_JACOBIAN) * 4.0 * jnp.abs(cos_d)
