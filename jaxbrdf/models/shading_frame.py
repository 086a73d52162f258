"""Learned shading frames (Zeltner et al., section 4.1): directions as seen from axes that a latent chooses.

Of six numbers of a latent's linear map the first three, added to (0, 0, 1), point along the normal, and the others,
added to (1, 0, 0), to the side of the tangent: a latent of zero has the surface's own frame.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

NUMBERS = 6
"""Of the latent's linear map for one frame."""

LEAST_SQUARE = 1e-6
"""|v|^2 from which a vector gives a whole axis; shorter ones shrink it. It bounds the derivative of an axis by 1e3, and
is met only where a latent turns the normal upside down, or the tangent into the normal."""

Rows = tuple[jax.Array, jax.Array, jax.Array]


class Frame(NamedTuple):
    """Orthonormal axes, components `(batch,)` each."""

    tangent: Rows
    bitangent: Rows
    normal: Rows


def frame_of(numbers: jax.Array) -> Frame:
    """The frame of `(6, batch)` numbers."""
    normal = _unit((numbers[0], numbers[1], 1.0 + numbers[2]))
    side = (1.0 + numbers[3], numbers[4], numbers[5])
    along = _dot(side, normal)
    tangent = _unit((side[0] - along * normal[0], side[1] - along * normal[1], side[2] - along * normal[2]))
    return Frame(tangent, _cross(normal, tangent), normal)


def seen(frame: Frame, w: jax.Array) -> jax.Array:
    """w `(3, batch)` in the frame; may lie below its horizon."""
    return jnp.stack([_dot(axis, (w[0], w[1], w[2])) for axis in frame])


def seen_above(frame: Frame, w: jax.Array) -> jax.Array:
    """w in the frame, projected to the unit disk and lifted again (Timonen et al., section 3.1).

    Of the height the lift keeps the size alone, sqrt(1 - x^2 - y^2) = |z|: taken from z it needs no root, whose
    derivative has no bound at the rim.
    """
    x, y, z = seen(frame, w)
    return jnp.stack([x, y, jnp.abs(z)])


def _unit(v: Rows) -> Rows:
    scale = jax.lax.rsqrt(jnp.maximum(_dot(v, v), LEAST_SQUARE))
    return v[0] * scale, v[1] * scale, v[2] * scale


def _dot(a: Rows, b: Rows) -> jax.Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Rows, b: Rows) -> Rows:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
