"""Learned shading frames (Zeltner et al., section 4.1): directions as seen from axes that a latent chooses.

Of six numbers of a latent's linear map the first three, added to (0, 0, 1), point along the normal, and the others,
added to (1, 0, 0), to the side of the tangent: a latent of zero has the surface's own frame.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import Components
from jaxbrdf.core.staging import staged_both_ways

NUMBERS = 6
"""Of the latent's linear map for one frame."""

LEAST_SQUARE = 1e-6
"""|v|^2 from which a vector gives a whole axis; shorter ones shrink it. It bounds the derivative of an axis by 1e3, and
is met only where a latent turns the normal upside down, or the tangent into the normal."""


LEAST_HEIGHT = 1e-6
"""Of |a| + |b| in `pair_above`, from which it has a derivative: the half vector's is up to its inverse, and directions
that are so nearly opposed on the frame's horizon have no half vector that a frame could be learned by."""


class Frame(NamedTuple):
    """Orthonormal axes, components `(batch,)` each."""

    tangent: Components
    bitangent: Components
    normal: Components


def frame_of(numbers: jax.Array) -> Frame:
    """The frame of `(6, batch)` numbers."""
    rows = staged_both_ways(jnp.unstack(numbers))
    normal = _unit((rows[0], rows[1], 1.0 + rows[2]))
    side = (1.0 + rows[3], rows[4], rows[5])
    along = _dot(side, normal)
    tangent = _unit((side[0] - along * normal[0], side[1] - along * normal[1], side[2] - along * normal[2]))
    return Frame(tangent, _cross(normal, tangent), normal)


def seen(frame: Frame, w: jax.Array) -> jax.Array:
    """w `(3, batch)` in the frame; may lie below its horizon."""
    return jnp.stack([_dot(axis, (w[0], w[1], w[2])) for axis in frame])


def pair_above(frame: Frame, both: Components, across: Components) -> tuple[Components, Components]:
    """wi + wo and (wi - wo) / 2 of directions in the frame, each projected to the unit disk and lifted again
    (Timonen et al., section 3.1).

    Of a height z the lift keeps the size alone, sqrt(1 - x^2 - y^2) = |z|: taken from z it needs no root, whose
    derivative has no bound at the rim. Sum and difference are seen instead of the directions: where these are almost
    opposed, the sum of what is seen of each would be nothing but rounding. Of heights a and b, |a| + |b| is the larger
    one of |a + b| and |a - b|, and |a| - |b| is the other one, with its partner's sign.

    Args:
        frame: the axes.
        both: wi + wo on the surface.
        across: (wi - wo) / 2 there.
    """
    (x, y, total), (u, v, half) = (tuple(_dot(axis, w) for axis in frame) for w in (both, across))
    apart = 2.0 * half
    on_one_side = jnp.abs(total) >= jnp.abs(apart)
    larger = jnp.where(on_one_side, total, apart)
    smaller = 0.5 * jnp.where(on_one_side, apart, total)
    height = jnp.abs(jnp.where(jnp.abs(larger) > LEAST_HEIGHT, larger, jax.lax.stop_gradient(larger)))
    return (x, y, height), (u, v, jnp.where(larger < 0, -smaller, smaller))


def _unit(v: Components) -> Components:
    scale = jax.lax.rsqrt(jnp.maximum(_dot(v, v), LEAST_SQUARE))
    return v[0] * scale, v[1] * scale, v[2] * scale


def _dot(a: Components, b: Components) -> jax.Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Components, b: Components) -> Components:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
