"""Measured materials in the adaptive parameterisation of Dupuy and Jakob (2018).

The viewer (our wo) fixes a slice of the tables; the microfacet normal m, half way between the directions, gives a point
u_m = (sqrt(2 theta_m / pi), phi_m / 2pi + 1/2) of the unit square; the inverse of the warp `vndf` takes it to the point where
the reflectance is stored:

    f cos(wi) = max(rgb(invert(u_m)), 0) ndf(u_m) / (4 sigma(u_o))

and the same warps, forwards, draw wi. The roles are those of Mitsuba's `measured` with its si.wi as our wo.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf import tabulated_warp
from jaxbrdf.brdf.tabulated_warp import Slices, Warp
from jaxbrdf.core.directions import above_horizon, cos_theta, dot, half_vector, reflect, sin_theta, spherical
from jaxbrdf.core.numerics import safe_atan2, safe_divide, safe_sqrt
from jaxbrdf.data.rgl import Rgl
from jaxbrdf.types import Brdf, Material, Query, Sample

LEAST_JACOBIAN = 1e-6
"""Floor of 2 pi^2 u_m sin(theta_m), which vanishes at the pole: a finite density there (Mitsuba's value)."""


@dataclass(frozen=True)
class Layout:
    """What a file's tables depend on; fixed when a function is compiled.

    Attributes:
        isotropic: azimuths count from the viewer's.
        symmetry: how many equal sectors the viewer's azimuth has: 1, 2 (turned by pi) or 4 (mirrored, too).
        jacobian: whether the reflectance is multiplied by ndf / (4 sigma).
    """

    isotropic: bool
    symmetry: int
    jacobian: bool


class RglParams(NamedTuple):
    """Tables of one material: P azimuths and T elevations of the viewer, S = P T slices.

    Attributes:
        phi: the viewer's azimuths, `(P,)`.
        theta: the viewer's elevations, `(T,)`.
        ndf: `(1, H, W)`.
        sigma: `(1, H, W)`.
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
    point: jax.Array
    forward: tuple[jax.Array, jax.Array]


def layout(data: Rgl) -> Layout:
    """The layout of a file's arrays; the sectors follow from the range of its azimuths."""
    span = float(data.phi_i[-1] - data.phi_i[0])
    sectors = 1 if data.isotropic else round(2.0 * np.pi / span)
    return Layout(data.isotropic, sectors if sectors in (2, 4) else 1, data.jacobian)


def params(data: Rgl) -> RglParams:
    """The tables with their integrals, computed once."""
    count = len(data.phi_i) * len(data.theta_i)

    def flat(table: np.ndarray) -> np.ndarray:
        return table.reshape(count, *table.shape[2:])

    return RglParams(
        phi=jnp.asarray(data.phi_i),
        theta=jnp.asarray(data.theta_i),
        ndf=jnp.asarray(data.ndf[None]),
        sigma=jnp.asarray(data.sigma[None]),
        vndf=tabulated_warp.warp(flat(data.vndf)),
        luminance=tabulated_warp.warp(flat(data.luminance)),
        rgb=jnp.asarray(np.moveaxis(flat(data.rgb), 1, -1)),
    )


def brdf(config: Layout) -> Brdf:
    """The pure functions for tables of this layout."""
    return Brdf(eval=partial(evaluate, config), sample=partial(sample, config), pdf=partial(pdf, config))


def material(data: Rgl, name: str) -> Material:
    """A file's arrays as a material."""
    return Material(name, brdf(layout(data)), params(data), data.isotropic)


def evaluate(config: Layout, tables: RglParams, query: Query) -> jax.Array:
    """f(wi, wo), `(..., 3)` in 1/sr; values that interpolate to less than zero become zero."""
    return jnp.maximum(unclamped(config, tables, query), 0.0)


def unclamped(config: Layout, tables: RglParams, query: Query) -> jax.Array:
    """f(wi, wo) as interpolated, `(..., 3)`: measurement noise makes some of it negative. Zero below the horizon."""
    wi, wo = _first_sector(config, query)
    viewer = _viewer(config, tables, wo)
    point, _ = _normal_to_point(half_vector(wi, wo), viewer)
    place, _ = tabulated_warp.invert(tables.vndf, viewer.slices, point)
    value = _reflected(config, tables, viewer, point, place)
    return jnp.where(above_horizon(wi, wo)[..., None], safe_divide(value, cos_theta(wi)[..., None]), 0.0)


def pdf(config: Layout, tables: RglParams, query: Query) -> jax.Array:
    """Density of `sample` at wi for the viewer wo, per solid angle, `(...)`; zero below the horizon."""
    wi, wo = _first_sector(config, query)
    viewer = _viewer(config, tables, wo)
    m = half_vector(wi, wo)
    point, sine = _normal_to_point(m, viewer)
    place, density = tabulated_warp.invert(tables.vndf, viewer.slices, point)
    light = tabulated_warp.interpolate(tables.luminance.density, viewer.slices, place)
    value = safe_divide(density * light, _solid_angle(point, sine, dot(wo, m)))
    return jnp.where(above_horizon(wi, wo), value, 0.0)


def sample(config: Layout, tables: RglParams, query: Query, u: jax.Array) -> Sample:
    """A direction to the light for the viewer `query.wo`; u[1:3] choose it, u[0] is not used.

    Directions that the mirror sends below the horizon are returned with their density and weight zero.
    """
    wo = _fold(config, query.wo, query.wo)
    viewer = _viewer(config, tables, wo)
    place, light = tabulated_warp.sample(tables.luminance, viewer.slices, jnp.flip(u[..., 1:3], axis=-1))
    point, density = tabulated_warp.sample(tables.vndf, viewer.slices, place)
    m, sine = _point_to_normal(point, viewer)
    wi = reflect(wo, m)
    value = jnp.maximum(_reflected(config, tables, viewer, point, place), 0.0)
    chosen = safe_divide(density * light, _solid_angle(point, sine, dot(wo, m)))
    lit = above_horizon(wi, wo)
    weight = jnp.where(lit[..., None], safe_divide(value, chosen[..., None]), 0.0)
    return Sample(_fold(config, wi, query.wo), jnp.where(cos_theta(wo) > 0, chosen, 0.0), weight)


def _reflected(config: Layout, tables: RglParams, viewer: Viewer, point: jax.Array, place: jax.Array) -> jax.Array:
    """f cos(wi), `(..., 3)`, at a normal's point and the place that it warps back to."""
    value = tabulated_warp.interpolate(tables.rgb, viewer.slices, place)
    if not config.jacobian:
        return value
    ndf = _single(tables.ndf, point)
    sigma = _single(tables.sigma, viewer.point)
    return value * safe_divide(ndf, 4.0 * sigma)[..., None]


def _single(table: jax.Array, point: jax.Array) -> jax.Array:
    """A table of one slice at a point."""
    shape = point.shape[:-1]
    return tabulated_warp.interpolate(table, Slices((jnp.zeros(shape, jnp.int32),), (jnp.ones(shape),)), point)


def _first_sector(config: Layout, query: Query) -> tuple[jax.Array, jax.Array]:
    """wi and wo, turned or mirrored so that wo lies in the sector that the tables hold."""
    return _fold(config, query.wi, query.wo), _fold(config, query.wo, query.wo)


def _fold(config: Layout, w: jax.Array, wo: jax.Array) -> jax.Array:
    """w under the symmetry that takes wo to negative y (and, with four sectors, negative x); its own inverse.

    Signs rather than comparisons: wo on the x axis must come out with y = -0, whose azimuth is -pi, the tables' first.
    """
    if config.symmetry == 1:
        return w
    y = -jnp.copysign(1.0, wo[..., 1])
    x = -jnp.copysign(1.0, wo[..., 0]) if config.symmetry == 4 else y
    return w * jnp.stack([x, y, jnp.ones_like(x)], axis=-1)


def _viewer(config: Layout, tables: RglParams, wo: jax.Array) -> Viewer:
    theta = jnp.arctan2(sin_theta(wo), cos_theta(wo))
    phi = safe_atan2(wo[..., 1], wo[..., 0])
    point = jnp.stack([safe_sqrt(theta * (2.0 / jnp.pi)), phi * (0.5 / jnp.pi) + 0.5], axis=-1)
    where = tabulated_warp.slices(phi, theta, (tables.phi, tables.theta))
    return Viewer(where, point, _forward(config, wo))


def _forward(config: Layout, wo: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The direction in the plane that has azimuth zero: the viewer's, or x where there is none to tell."""
    length = sin_theta(wo)
    turn = config.isotropic & (length > 0)
    return jnp.where(turn, safe_divide(wo[..., 0], length), 1.0), jnp.where(turn, safe_divide(wo[..., 1], length), 0.0)


def _normal_to_point(m: jax.Array, viewer: Viewer) -> tuple[jax.Array, jax.Array]:
    """The point of the normal m in the square of `vndf`, and the sine of its elevation."""
    x, y = viewer.forward
    sine = sin_theta(m)
    theta = jnp.arctan2(sine, cos_theta(m))
    phi = safe_atan2(x * m[..., 1] - y * m[..., 0], x * m[..., 0] + y * m[..., 1])
    return jnp.stack([safe_sqrt(theta * (2.0 / jnp.pi)), phi * (0.5 / jnp.pi) + 0.5], axis=-1), sine


def _point_to_normal(point: jax.Array, viewer: Viewer) -> tuple[jax.Array, jax.Array]:
    """Inverse of `_normal_to_point`."""
    x, y = viewer.forward
    theta = point[..., 0] ** 2 * (0.5 * jnp.pi)
    m = spherical(theta, (2.0 * point[..., 1] - 1.0) * jnp.pi)
    turned = [x * m[..., 0] - y * m[..., 1], y * m[..., 0] + x * m[..., 1], m[..., 2]]
    return jnp.stack(turned, axis=-1), jnp.sin(theta)


def _solid_angle(point: jax.Array, sine: jax.Array, cos_d: jax.Array) -> jax.Array:
    """Solid angle of wi for a unit of the square: 2 pi^2 u_m sin(theta_m) 4 (wo . m)."""
    return jnp.maximum(2.0 * jnp.pi**2 * point[..., 0] * sine, LEAST_JACOBIAN) * 4.0 * cos_d
