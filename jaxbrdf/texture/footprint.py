"""How a footprint is covered by bilinear lookups in a pyramid.

A footprint J takes the unit filter, a Gaussian of standard deviation 1/2, to uv: its covariance in texels of the finest
level is A A^T / 4 with A = diag(width, height) J, whose singular values M >= m are twice its standard deviations.

A texel of level l is a mean over 2^l texels, of variance 4^l / 12; a bilinear lookup there adds the variance
4^l f (1 - f) at the fraction f between two texels, 4^l / 6 in the mean over all places. Together 4^l / 4: the lookup
covers a round footprint of M = m = 2^l. What this file promises of variances holds in that mean.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_divide, safe_sqrt
from jaxbrdf.texture.pyramid import Layout

LARGEST = 2.0**30
"""Entries of a footprint in texels are clamped to this, beyond any pyramid: infinite ones are defined too, and fourth
powers stay finite in float32."""


class Ellipse(NamedTuple):
    """The singular values of a matrix and the direction of the larger one, each `(...)`.

    Attributes:
        major, minor: both within rounding of the major one.
        excess: (major^2 - minor^2) / 4, with its own digits.
        x, y: unit vector along the major axis; (1, 0) where the two are equal.
    """

    major: jax.Array
    minor: jax.Array
    excess: jax.Array
    x: jax.Array
    y: jax.Array


class Probes(NamedTuple):
    """Equal lookups, evenly spaced along a line through the centre, each `(...)`.

    Attributes:
        count: their number, int32.
        u, v: the step from one to the next.
        lod: where each is read, `trilinear`'s.
    """

    count: jax.Array
    u: jax.Array
    v: jax.Array
    lod: jax.Array


def ellipse(layout: Layout, footprint: jax.Array) -> Ellipse:
    """The ellipse of a footprint `(..., 2, 2)` in texels of the finest level.

    A is a rotation and scale plus a reflection and scale, which as complex numbers are p and q: then M = |p| + |q|,
    m = ||p| - |q||, (M^2 - m^2) / 4 = |p q|, and the major axis is along the square root of p q. Value and gradient are
    finite where A is zero, singular or round. A NaN stays.
    """
    x, y = layout.width * footprint[..., 0, :], layout.height * footprint[..., 1, :]
    a, b, c, d = (jnp.clip(n, -LARGEST, LARGEST) for n in (x[..., 0], x[..., 1], y[..., 0], y[..., 1]))
    p_x, p_y, q_x, q_y = 0.5 * (a + d), 0.5 * (c - b), 0.5 * (a - d), 0.5 * (c + b)
    p, q = _length(p_x, p_y), _length(q_x, q_y)
    x, y = _half_angle(p_x * q_x - p_y * q_y, p_x * q_y + p_y * q_x)
    # zero, or NaN, which a length hides
    fault = 0.0 * (a + b + c + d)
    return Ellipse(p + q + fault, jnp.abs(p - q) + fault, p * q, x, y)


def _length(x: jax.Array, y: jax.Array) -> jax.Array:
    return safe_sqrt(x * x + y * y)


def _half_angle(x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Unit vector at half the angle of (x, y), by the sum that does not cancel; (1, 0) at the origin."""
    length = _length(x, y)
    far, near = length + jnp.abs(x), y
    scale = safe_divide(jnp.ones_like(x), _length(far, near))
    along, across = jnp.where(scale > 0, far * scale, 1.0), near * scale
    return jnp.where(x < 0, across, along), jnp.where(x < 0, along, across)


def lod_of(layout: Layout, scale: jax.Array) -> jax.Array:
    """Where `trilinear` covers a round footprint of `scale` texels, between 0 and the last level.

    A share t of level l + 1 beside 1 - t of level l has the variance 4^l (1 + 3 t) / 4: t is (scale^2 / 4^l - 1) / 3.
    At powers of two this is log2(scale), by which textures are commonly read; between them that has up to 26% more
    variance than the footprint. Less than a texel is level 0: no lookup is sharper. A NaN stays.
    """
    scale = jnp.clip(scale, 1.0, 2.0**layout.top)
    number = jnp.clip(jnp.floor(jnp.log2(scale)), 0.0, layout.top)
    ratio = scale * jnp.exp2(-number)
    return number + jnp.clip((ratio * ratio - 1.0) / 3.0, 0.0, 1.0)


def probes_of(layout: Layout, footprint: jax.Array, *, most: int) -> Probes:
    """At most `most` lookups that together have the footprint's covariance, as far as these can.

    The minor axis is raised to M / most, and to the one texel that a lookup covers at least. N lookups of that width at
    steps s along the major axis have the variance s^2 (N^2 - 1) / 12 + m^2 / 4 along it, which gives s; N is the least
    number for which s <= m, so that a bilinear lookup leaves no gap, as far as `most` allows: at the largest ratio of
    axes the steps are sqrt(3) times as wide.
    """
    axes = ellipse(layout, footprint)
    least = jnp.maximum(axes.major / most, 1.0)
    minor = jnp.maximum(axes.minor, least)
    beyond = 0.25 * (axes.major - minor) * (axes.major + minor)
    excess = jnp.where(axes.minor < least, jnp.maximum(beyond, 0.0), axes.excess)
    number = jnp.clip(jnp.ceil(jnp.sqrt(1.0 + 12.0 * excess / (minor * minor))), 1.0, most)
    step = jnp.where(number > 1.0, safe_sqrt(12.0 * excess / jnp.maximum(number * number - 1.0, 1.0)), 0.0)
    count = jnp.clip(number.astype(jnp.int32), 1, most)
    return Probes(count, step * axes.x / layout.width, step * axes.y / layout.height, lod_of(layout, minor))
