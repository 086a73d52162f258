"""Random places and footprints on a texture, as training draws them (Timonen et al., Eq. 9).

    J = e R(phi) diag((1 + z) / cos_o, 1),   log2 e = l_min + (l_max - l_min) (exp(5 t) - 1) / (exp(5) - 1)

with t uniform in [0, 1), z normal of deviation 0.2, phi uniform, and cos_o the viewer's cosine: the more slanted the
view, the longer the footprint. e runs from an eighth of a texel to twice the whole texture, fine ones more often. The
paper prints the diagonal matrix on the left of R, which would never turn the ellipse of a round filter.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.smith import lift

FINEST_TEXELS = 1.0 / 8.0
"""Of the smallest footprint; the paper's 2^-13 at 1024 texels."""

COARSEST = 1.0
"""log2 of the largest footprint in uv, l_max."""

CROWDING = 5.0
"""How much more often fine footprints are drawn: of log2 e the density falls by a factor of exp(5)."""

SPREAD = 0.2
"""Deviation of z, of the footprint's length about what the view's slant makes it."""


def draw_places(
    key: jax.Array, wo: jax.Array, *, texels: int, crowding: float = CROWDING, stretched: bool = True
) -> tuple[jax.Array, jax.Array]:
    """uv `(..., 2)` uniform in the unit square and a footprint `(..., 2, 2)` for every viewer `(..., 3)`.

    Args:
        key: chooses them.
        wo: viewers.
        texels: along the texture's longer side.
        crowding: positive; see `CROWDING`, the paper's.
        stretched: as the view's slant makes them; otherwise all are round, of size e.
    """
    key_uv, key_scale, key_turn, key_length = jax.random.split(key, 4)
    batch = wo.shape[:-1]
    uv = jax.random.uniform(key_uv, (*batch, 2), wo.dtype)
    e = footprint_scale(jax.random.uniform(key_scale, batch, wo.dtype), texels=texels, crowding=crowding)
    phi = 2.0 * jnp.pi * jax.random.uniform(key_turn, batch, wo.dtype)
    if not stretched:
        return uv, turned_footprint(e, e, phi)
    length = (1.0 + SPREAD * jax.random.normal(key_length, batch, wo.dtype)) / cos_theta(lift(wo))
    return uv, turned_footprint(e * length, e, phi)


def footprint_scale(t: jax.Array, *, texels: int, crowding: float = CROWDING) -> jax.Array:
    """e of t in [0, 1): from `FINEST_TEXELS` of that many to 2^`COARSEST`."""
    finest = jnp.log2(FINEST_TEXELS / texels)
    return jnp.exp2(finest + (COARSEST - finest) * jnp.expm1(crowding * t) / jnp.expm1(crowding))


def turned_footprint(along: jax.Array, across: jax.Array, phi: jax.Array) -> jax.Array:
    """R(phi) diag(along, across), `(..., 2, 2)`."""
    c, s = jnp.cos(phi), jnp.sin(phi)
    return jnp.stack(
        [jnp.stack([c * along, -s * across], axis=-1), jnp.stack([s * along, c * across], axis=-1)], axis=-2
    )
