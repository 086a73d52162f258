"""The Beckmann distribution of microfacet normals: slopes of density exp(-|A^-1 (s - mu)|^2) / (pi det A).

(Beckmann and Spizzichino 1963; in tensor form Gauthier et al. 2022, appendix A.2, here with the exact projected area
instead of Walter et al.'s rational approximation of it, which is up to 0.4 % off.)
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.special import erf, erfc, erfinv

from jaxbrdf.core.ggx import SLOPE
from jaxbrdf.core.microsurface import standard_normal, standard_view, surface_normal
from jaxbrdf.core.numerics import safe_divide, safe_norm, safe_normalize
from jaxbrdf.core.roughness import Roughness

STEEPEST = 10.0
"""cot of the angle from which on a surface is seen as from above: erfc(10) = 2e-45."""

_TWO_ROOT_PI = 3.5449077018110318

NEWTON_STEPS = 4
"""Leave 2e-9 of the area at any angle, by comparison with more steps in float64; three leave 1e-6."""


class Beckmann(NamedTuple):
    """roughness: a record of `jaxbrdf.core.roughness`. slope: mean slope `(2,)` or `(..., 2)`; None if centred."""

    roughness: Roughness
    slope: Annotated[jax.Array, SLOPE] | None = None

    def density(self, wh: jax.Array) -> jax.Array:
        """D(wh) = exp(1 - |M^-1 wh|^2 / cos^2) / (pi det A cos^4) [1/sr] (Heitz 2014, Eq. 79), zero below the horizon.

        It integrates to one against the cosine of wh.
        """
        x, y, z = jnp.moveaxis(standard_normal(*self, wh), -1, 0)
        # beyond, exp(-|..|^2 / cos^2) underflows while 1 / cos^4 overflows
        held = (z > 0) & (x * x + y * y < -math.log(jnp.finfo(z.dtype).tiny) * z * z)
        secant = 1.0 / jnp.where(held, z, 1.0)
        squared = secant * secant
        density = jnp.exp(-(x * x + y * y) * squared) * squared * squared / (jnp.pi * self.roughness.determinant())
        return jnp.where(held, density, 0.0)

    def projected_area(self, w: jax.Array) -> jax.Array:
        """Area of the facets that w sees per area of the surface (Heitz 2014, Eq. 68 and 72).

        With v = M^T w and a = v_z / |v_xy|: v_z erfc(-a) / 2 + |v_xy| exp(-a^2) / (2 sqrt(pi)).
        """
        view = standard_view(*self, w)
        across, z = safe_norm(view[..., :2]), view[..., 2]
        a = _cotangent(across, z)
        area = 0.5 * z * erfc(-a) + across * jnp.exp(-a * a) / _TWO_ROOT_PI
        # below -`STEEPEST` the two no longer cancel, and leave less than nothing
        return jnp.maximum(area, 0.0)

    def sample_visible(self, wo: jax.Array, u: jax.Array) -> jax.Array:
        """A normal of density <wo, wh> D(wh) / projected area, by inversion (Heitz and d'Eon 2014; Jakob 2014).

        On the standard surface the slope across the view is normal, and the one along it, t, has a density in
        proportion to (a - t) exp(-t^2) for t < a. Its integral is inverted in e = erf(t), where its slope is
        (a - t) / 2, by Newton's steps. Exact while e has digits: where facets lean away from the view by so much that
        it sees less than 1e-4 of them, draws are coarse in float32, and what they carry is as little.

        Args:
            wo: `(..., 3)`, above the horizon.
            u: uniform in [0, 1), `(..., 2)`.
        """
        view = safe_normalize(standard_view(*self, wo))
        across = safe_norm(view[..., :2])
        cos_phi = jnp.where(across > 0, safe_divide(view[..., 0], across), 1.0)
        sin_phi = safe_divide(view[..., 1], across)
        along, aside = _visible_slope(across, view[..., 2], u[..., 0]), _slope(u[..., 1])
        x, y = cos_phi * along - sin_phi * aside, sin_phi * along + cos_phi * aside
        return surface_normal(*self, jnp.stack([-x, -y, jnp.ones_like(x)], axis=-1))


def _slope(u: jax.Array) -> jax.Array:
    """The slope below which the share u of all facets lies; finite for u = 0."""
    least = float(jnp.finfo(u.dtype).epsneg)
    return erfinv(jnp.maximum(2.0 * u - 1.0, least - 1.0))


def _visible_slope(across: jax.Array, z: jax.Array, u: jax.Array) -> jax.Array:
    """The slope t whose share of the visible area is u, on a standard surface seen along (across, z)."""
    # erfinv is finite up to the float next to one
    most = 1.0 - float(jnp.finfo(u.dtype).epsneg)
    # at the flat end rounding would throw a step far; with this slope it costs no more than the rounding itself, and
    # what is steeper up there is the last flattest^2 of the area
    flattest = float(jnp.finfo(u.dtype).eps) ** 0.5
    low, high = jnp.full_like(u, -most), jnp.clip(erf(_cotangent(across, z)), -most, most)
    whole = _area_up_to(high, erfinv(high), across, z)

    def step(_: int, e: jax.Array) -> jax.Array:
        t = erfinv(e)
        excess = _area_up_to(e, t, across, z) - u * whole
        return jnp.clip(e - 2.0 * excess / jnp.maximum(z - across * t, flattest), low, high)

    # exact for an area quadratic in e with a flat end
    start = high - (high - low) * jnp.sqrt(1.0 - u)
    return erfinv(jax.lax.fori_loop(0, NEWTON_STEPS, step, start))


def _area_up_to(e: jax.Array, t: jax.Array, across: jax.Array, z: jax.Array) -> jax.Array:
    """Visible area of slopes below t = erfinv(e): z (1 + e) / 2 + across exp(-t^2) / (2 sqrt(pi))."""
    return 0.5 * z * (1.0 + e) + across * jnp.exp(-t * t) / _TWO_ROOT_PI


def _cotangent(across: jax.Array, z: jax.Array) -> jax.Array:
    """z / across within +-`STEEPEST`."""
    inside = jnp.abs(z) < STEEPEST * across
    ratio = z / jnp.where(inside, across, 1.0)
    return jnp.where(inside, ratio, jnp.where(z > 0, STEEPEST, -STEEPEST))
