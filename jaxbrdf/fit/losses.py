"""Losses over log-reflectance. Each is unreduced: `(3, batch)` or `(batch,)`, its mean is what a fit minimises.

All take `log_f`, the model's ln f `(3, batch)`, and a `Batch`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.fit.batch import Batch

LARGEST_LOG = 30.0
"""exp(30) = 1e13: above any measured value (1e7), and its square still fits float32."""

SMAPE_OFFSET = 1e-3
"""The floor of relative errors, as in `jaxbrdf.metrics.brdf_space`."""


class Scale(NamedTuple):
    """Size of the target under cosine-distributed directions, by which losses become dimensionless.

    Attributes:
        mean: E f, over directions and channels, `()`.
        mean_square: E f^2, `()`.
    """

    mean: jax.Array
    mean_square: jax.Array


class LossWeights(NamedTuple):
    """Shares of `balanced`'s three terms."""

    relative: float = 1.0
    absolute: float = 1.0
    square: float = 1.0


EQUAL_WEIGHTS = LossWeights()

Loss = Callable[[jax.Array, Batch, Scale], jax.Array]


def scale_of(batch: Batch) -> Scale:
    """The scale of a pool of draws; at least 1e-6, so that a black material divides by something."""
    weighted = batch.importance[None] * batch.target
    return Scale(jnp.maximum(jnp.mean(weighted), 1e-6), jnp.maximum(jnp.mean(weighted * batch.target), 1e-12))


def mixture(log_f: jax.Array, batch: Batch, scale: Scale, *, share: float = 0.9999, epsilon: float = 1e-6) -> jax.Array:
    """Prediction-relative and plain squared error (Timonen et al., Eq. 10), `(batch,)`.

    share |f - p|^2 / |SG(p) + epsilon|^2 + (1 - share) |f - p|^2, norms over the channels. Draws are not reweighted:
    the paper draws its directions as it measures them.
    """
    del scale
    p = _exp(log_f)
    square = jnp.sum((batch.target - p) ** 2, axis=0)
    size = jnp.sum((jax.lax.stop_gradient(p) + epsilon) ** 2, axis=0)
    return share * square / size + (1.0 - share) * square


def tempered(log_f: jax.Array, batch: Batch, scale: Scale, *, floor: float = 0.3, most: float = 10.0) -> jax.Array:
    """Squared error over the prediction and over the prediction or the material's mean, `(3, batch)`.

    |f - p|^2 / ((SG(p) + SMAPE_OFFSET) (SG(p) + floor E f)): relative where the material is bright, and the error of a
    square root where it is dark, about as sRGB shows it. Like `mixture` it is least where p is the mean of noisy f,
    which relative or logarithmic errors of f itself are not (Lehtinen et al. 2018), but for the rarest f: one counts
    as `most` (SG(p) + floor E f) at most. The gradient by ln p would otherwise have no bound, and a highlight that the
    prediction misses by orders of magnitude undoes a training. A mean of which rarer hits than one in `most` are the
    better part is fitted too dark, by what they have beyond that.
    """
    p = _exp(log_f)
    held = jax.lax.stop_gradient(p)
    bright = held + floor * scale.mean
    square = (jnp.minimum(batch.target, most * bright) - p) ** 2
    return batch.importance[None] * square / ((held + SMAPE_OFFSET) * bright)


def log_domain(log_f: jax.Array, batch: Batch, scale: Scale, *, offset: float = SMAPE_OFFSET) -> jax.Array:
    """|ln(p + offset) - ln(f + offset)|, `(3, batch)`: relative error, blind below the offset."""
    del scale
    return jnp.abs(jnp.log(_exp(log_f) + offset) - jnp.log(batch.target + offset))


def balanced(log_f: jax.Array, batch: Batch, scale: Scale, *, weights: LossWeights = EQUAL_WEIGHTS) -> jax.Array:
    """Relative, absolute and squared error together, each dimensionless, `(3, batch)`.

    With the draws' importance, the terms' means are SMAPE, MAE / E f and MSE / E f^2: the first sees dark regions, the
    second the bulk of the energy, the third highlights and the horizon. Any one alone gives the others away.
    """
    p = _exp(log_f)
    difference = jnp.abs(p - batch.target)
    relative = 2.0 * difference / (p + batch.target + SMAPE_OFFSET)
    square = difference * difference / scale.mean_square
    total = weights.relative * relative + weights.absolute * difference / scale.mean + weights.square * square
    return batch.importance[None] * total


def _exp(log_f: jax.Array) -> jax.Array:
    return jnp.exp(jnp.minimum(log_f, LARGEST_LOG))
