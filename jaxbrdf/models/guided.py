"""First latents from what is known of a surface: its maps, so that a fit need not find every texel from noise.

A latent's first number is one, the next two are the mean slopes of the normal map, and the others the principal
components of what the maps say besides, each over its deviation. The first frame is that of the mean normal. Zeltner et
al. (section 4.3) reach the same end with an encoder network, which is trained first and read out once.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp

from jaxbrdf.models.shading_frame import NUMBERS
from jaxbrdf.texture.pyramid import Pyramid

KNOWN = 3
"""Numbers of a latent that are one and the slopes."""

LEAST_DEVIATION = 1e-4
"""Of what varies at all: half a level of eight bits is 2e-3. Constant channels become zero, not noise."""


def guided(params: Any, features: jax.Array) -> Any:
    """A spatial model's parameters with first latents, and a first frame where it has one.

    Args:
        params: a record with the pyramid `s`, and perhaps `frame`, `(channels, 6 n)`.
        features: of every texel of the pyramid, the slopes of its mean normal first, `(texels, 2 + k)`.

    Raises:
        ValueError: if the pyramid has fewer than 3 channels.
    """
    s = params.s
    channels = s.texels.shape[1]
    if channels < KNOWN:
        raise ValueError(f"latents have {channels} channels; one and two slopes need {KNOWN}")
    deviations = jnp.std(features[:, :2], axis=0)
    latents = jnp.concatenate(
        [
            jnp.ones((len(features), 1)),
            _standardised(features[:, :2]),
            _principal(_standardised(features[:, 2:]), channels - KNOWN),
        ],
        axis=1,
    )
    params = params._replace(s=Pyramid(s.layout, latents))
    if getattr(params, "frame", None) is None:
        return params
    return params._replace(frame=_first_frame(params.frame, jnp.mean(features[:, :2], axis=0), deviations))


def _standardised(x: jax.Array) -> jax.Array:
    """Columns of mean zero and deviation one; zero where nothing varies."""
    deviation = jnp.std(x, axis=0, keepdims=True)
    varies = deviation > LEAST_DEVIATION
    return jnp.where(varies, (x - jnp.mean(x, axis=0, keepdims=True)) / jnp.where(varies, deviation, 1.0), 0.0)


def _principal(x: jax.Array, count: int) -> jax.Array:
    """The first principal components of centred columns, standardised, `(n, count)`; zero past the last one."""
    _, vectors = jnp.linalg.eigh(x.T @ x / len(x))
    found = _standardised(x @ vectors[:, ::-1][:, :count])
    return jnp.pad(found, ((0, 0), (0, count - found.shape[1])))


def _first_frame(frame: jax.Array, mean: jax.Array, deviations: jax.Array) -> jax.Array:
    """Of every frame the normal's numbers are the slopes (x / z, y / z), of latents as `guided` makes them."""
    rows = jnp.zeros((frame.shape[0], NUMBERS))
    rows = rows.at[0, :2].set(mean).at[1, 0].set(deviations[0]).at[2, 1].set(deviations[1])
    return jnp.tile(rows, (1, frame.shape[1] // NUMBERS))
