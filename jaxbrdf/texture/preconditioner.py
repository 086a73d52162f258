"""Smoothing of a texture's updates, so that neighbouring texels learn together (Timonen et al., section 4.3).

The paper optimises raw texels r and evaluates T = K r, with K a blur of falloff 1 / (1 + A |f|). K is linear and
symmetric, so T itself can be the variable: Adam is shown K g instead of the gradient g, and its step d becomes K d. The
trajectory is the same.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp


def smooth(texture: jax.Array, strength: float) -> jax.Array:
    """K applied to `(channels, n_r, n_phi)`; K is symmetric, and 1 is its largest eigenvalue.

    The azimuth wraps; the radius is mirrored at centre and rim, which do not touch.
    """
    _, n_r, n_phi = texture.shape
    mirrored = jnp.concatenate([texture, texture[:, ::-1]], axis=1)
    spectrum = jnp.fft.rfft2(mirrored) * falloff(n_r, n_phi, strength)[None]
    return jnp.fft.irfft2(spectrum, s=mirrored.shape[1:])[:, :n_r]


def falloff(n_r: int, n_phi: int, strength: float) -> jax.Array:
    """1 / (1 + A sqrt(f_r^2 + f_phi^2)) on the half spectrum of the mirrored texture.

    The paper names no unit for f and calls the kernel small: we take cycles a texel, where A = 5 damps the finest
    detail to 0.22.
    """
    f_r = jnp.fft.fftfreq(2 * n_r)[:, None]
    f_phi = jnp.fft.rfftfreq(n_phi)[None, :]
    return 1.0 / (1.0 + strength * jnp.sqrt(f_r * f_r + f_phi * f_phi))
