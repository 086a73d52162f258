"""Smoothing of a texture's updates, so that neighbouring texels learn together (Timonen et al., section 4.3).

The paper optimises raw texels r and evaluates T = K r, with K a blur of falloff 1 / (1 + A |f|). K is linear and
symmetric, so T itself can be the variable: Adam is shown K g instead of the gradient g, and its step d becomes K d. The
trajectory is the same.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.texture.pyramid import Layout, Wrap, level


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
    return _falloff(2 * n_r, n_phi, strength)


def smooth_pyramid(layout: Layout, texels: jax.Array, strength: float) -> jax.Array:
    """K applied to each level of a pyramid `(texels, channels)`; the paper has A = 10 for these.

    A texture that repeats is periodic; any other is mirrored at its borders, which do not touch.
    """
    images = [_smooth_image(layout.wrap, level(layout, texels, n), strength) for n in range(layout.top + 1)]
    return jnp.concatenate([image.reshape(-1, texels.shape[1]) for image in images])


def _smooth_image(wrap: Wrap, image: jax.Array, strength: float) -> jax.Array:
    rows, columns, _ = image.shape
    if wrap != "repeat":
        image = jnp.concatenate([image, image[::-1]], axis=0)
        image = jnp.concatenate([image, image[:, ::-1]], axis=1)
    damping = _falloff(image.shape[0], image.shape[1], strength)
    spectrum = jnp.fft.rfft2(image, axes=(0, 1)) * damping[:, :, None]
    return jnp.fft.irfft2(spectrum, s=image.shape[:2], axes=(0, 1))[:rows, :columns]


def _falloff(rows: int, columns: int, strength: float) -> jax.Array:
    f_y, f_x = jnp.fft.fftfreq(rows)[:, None], jnp.fft.rfftfreq(columns)[None, :]
    return 1.0 / (1.0 + strength * jnp.sqrt(f_y * f_y + f_x * f_x))
