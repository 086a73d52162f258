"""The frame in which the viewer's azimuth is zero, where an isotropic material depends on its elevation alone."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import turn_to_azimuth_zero


def to_view(w: jax.Array, wo: jax.Array) -> jax.Array:
    """w turned about the normal until wo has azimuth zero; unchanged where wo is the normal."""
    return turn_to_azimuth_zero(w, wo, wo)[0]


def from_view(w: jax.Array, wo: jax.Array) -> jax.Array:
    """Inverse of `to_view`: w turned by wo's azimuth."""
    opposite = jnp.stack([wo[..., 0], -wo[..., 1], wo[..., 2]], axis=-1)
    return turn_to_azimuth_zero(w, w, opposite)[0]
