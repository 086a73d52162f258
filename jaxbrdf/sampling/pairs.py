"""Draws of (wi, wo) for means over two cosine-distributed directions, with enough of them in the highlights.

Half of the pairs are cosine-distributed, half are drawn by their half vector wh, which crowds about the normal on every
scale from 1e-4 to 1 radian, and their difference vector wd, uniform over the hemisphere. With
cos_d = wi . wh,

    d wi d wo = 4 cos_d d wh d wd

for d wo = 4 (wi . wh) d wh at fixed wi (Walter et al. 2007, Eq. 14), and at fixed wh the frame of Rusinkiewicz (1998)
turns wi into wd rigidly. So that half's density is p(wh) p(wd) / (4 cos_d), and the mixture's the mean of both.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import above_horizon, cos_theta, from_half_difference
from jaxbrdf.core.numerics import safe_divide, safe_norm, safe_normalize, safe_sqrt, tiny
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine, square_to_uniform
from jaxbrdf.types import Query

# 1 - cos of 1e-4 radian: half vectors are uniform within that angle and logarithmic in 1 - cos beyond it.
CORE = 5e-9


class Pairs(NamedTuple):
    """Directions `(n, 3)`, some below the horizon, and their density `(n,)` per solid angle of wi and of wo."""

    wi: jax.Array
    wo: jax.Array
    density: jax.Array


def draw_pairs(key: jax.Array, count: int) -> Pairs:
    """`count` pairs, the first half cosine-distributed, the second half drawn in half/difference space.

    Raises:
        ValueError: an odd count.
    """
    if count % 2:
        raise ValueError(f"count is {count}; it must be even, half of the pairs are drawn in each of two ways")
    u = jax.random.uniform(key, (4, count // 2, 2))
    wi, wo = from_half_difference(square_to_half_vector(u[2]), square_to_uniform(u[3]))
    wi = jnp.concatenate([square_to_cosine(u[0]), safe_normalize(wi)])
    wo = jnp.concatenate([square_to_cosine(u[1]), safe_normalize(wo)])
    return Pairs(wi, wo, pair_density(wi, wo))


def importance(pairs: Pairs) -> jax.Array:
    """Weights `(n,)` that turn a mean over `pairs` into one over cosine-distributed wi and wo.

    (cos_i cos_o / pi^2) / density: at most 2, since half of the pairs are cosine-distributed, zero below the horizon,
    and 1 on the mean.
    """
    return safe_divide(_cosine_pair_density(pairs.wi, pairs.wo), pairs.density)


def draw_weighted(key: jax.Array, count: int) -> tuple[Query, jax.Array]:
    """`count` queries and their importance, as error estimates take them.

    A pair below the horizon, whose weight is zero, is put to the normal, where every BRDF has a value.
    """
    pairs = draw_pairs(key, count)
    lit = above_horizon(pairs.wi, pairs.wo)[..., None]
    normal = jnp.array([0.0, 0.0, 1.0], pairs.wi.dtype)[None, :]
    return Query(jnp.where(lit, pairs.wi, normal), jnp.where(lit, pairs.wo, normal)), importance(pairs)


def pair_density(wi: jax.Array, wo: jax.Array) -> jax.Array:
    """Density of `draw_pairs` at wi, wo, both `(..., 3)`."""
    return 0.5 * _cosine_pair_density(wi, wo) + 0.5 * _half_difference_pair_density(wi, wo)


def square_to_half_vector(u: jax.Array) -> jax.Array:
    """Half vector with 1 - cos = t of density 1 / (L (t + core)), L = log(1 + 1 / core), and uniform azimuth."""
    t = CORE * jnp.expm1(u[..., 0] * jnp.log1p(1.0 / CORE))
    sin, phi = safe_sqrt(t * (2.0 - t)), 2.0 * jnp.pi * u[..., 1]
    return jnp.stack([sin * jnp.cos(phi), sin * jnp.sin(phi), 1.0 - t], axis=-1)


def half_vector_density(wh: jax.Array) -> jax.Array:
    """Density of `square_to_half_vector` per solid angle; t = sin^2 / (1 + cos) keeps its digits near the normal."""
    t = (wh[..., 0] ** 2 + wh[..., 1] ** 2) / (1.0 + jnp.maximum(wh[..., 2], 0.0))
    density = 1.0 / (2.0 * jnp.pi * jnp.log1p(1.0 / CORE) * (t + CORE))
    return jnp.where(wh[..., 2] > 0, density, 0.0)


def _cosine_pair_density(wi: jax.Array, wo: jax.Array) -> jax.Array:
    return jnp.where(above_horizon(wi, wo), cosine_density(wi) * cosine_density(wo), 0.0)


def _half_difference_pair_density(wi: jax.Array, wo: jax.Array) -> jax.Array:
    """p(wh) (1 / 2 pi) / (4 cos_d), with cos_d = |wi + wo| / 2 for unit vectors."""
    both = wi + wo
    length = jnp.maximum(safe_norm(both), jnp.sqrt(tiny(cos_theta(both))))
    return half_vector_density(safe_normalize(both)) / (4.0 * jnp.pi * length)
