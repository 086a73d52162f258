"""Linear Rec.709 and its display encoding."""

from __future__ import annotations

import jax
import jax.numpy as jnp

# Rows of the Rec.709 primaries' luminance, ITU-R BT.709-6, section 3.2.
REC709_LUMINANCE = (0.2126, 0.7152, 0.0722)


def luminance(rgb: jax.Array) -> jax.Array:
    """Luminance of linear Rec.709 colours, `(..., 3)` to `(...)`."""
    r, g, b = REC709_LUMINANCE
    return r * rgb[..., 0] + g * rgb[..., 1] + b * rgb[..., 2]


def srgb_encode(linear: jax.Array) -> jax.Array:
    """Linear values to sRGB's encoded ones, each in [0, 1] (IEC 61966-2-1); values outside are clamped."""
    linear = jnp.clip(linear, 0.0, 1.0)
    dark = linear <= 0.0031308
    power = 1.055 * jnp.where(dark, 1.0, linear) ** (1.0 / 2.4) - 0.055
    return jnp.where(dark, 12.92 * linear, power)


def srgb_decode(encoded: jax.Array) -> jax.Array:
    """sRGB's encoded values to linear ones, each in [0, 1]; inverse of `srgb_encode`."""
    encoded = jnp.clip(encoded, 0.0, 1.0)
    return jnp.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
