"""First and second moments of a normal map's slopes, which are means and so are filtered as colours are.

A normal (-s, 1) / |(-s, 1)| has the slopes s. Under a footprint their mean is mu = E[s] and their covariance
C = E[s s^T] - mu mu^T (Olano and Baker 2010; Toksvig 2005 for lengths of normals). The facets of every point add their
own spread: that of Beckmann facets of roughness alpha has the variance alpha^2 / 2 along each axis, and so a Gaussian
of covariance C is made of facets of roughness A, A^2 = 2 C + E[alpha^2]. The slopes of GGX facets have no variance;
the usual practice, which this is too, takes the same A for them.

The mean of alpha^2 stands beside the moments, not in them, where it would be lost: in float32 C is uncertain by a few
2^-24 |mu|^2, a roughness of 4e-4 at slopes of one, and is taken as no less than zero.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.metallic_roughness import MetallicRoughnessParams
from jaxbrdf.core.ggx import SLOPE
from jaxbrdf.core.numerics import safe_sqrt
from jaxbrdf.core.ranges import clamp
from jaxbrdf.core.roughness import Tensor


class Moments(NamedTuple):
    """What is known of the facets under a footprint.

    Attributes:
        base_color: mean, `(..., 3)`.
        metallic: mean, `(...)`.
        alpha_squared: mean square of the facets' roughness, `(...)`.
        slope: their mean slope mu, `(..., 2)`.
        covariance: C as a record of its entries, each `(...)`.
    """

    base_color: jax.Array
    metallic: jax.Array
    alpha_squared: jax.Array
    slope: jax.Array
    covariance: Tensor


def slopes_of(normal: jax.Array) -> jax.Array:
    """-(n_x, n_y) / n_z, `(..., 2)`, with n_z raised to where a unit normal's slopes end (`jaxbrdf.core.ggx.SLOPE`)."""
    return -normal[..., :2] / jnp.maximum(normal[..., 2:], 1.0 / SLOPE.high)


def pack_slopes(params: MetallicRoughnessParams, normal: jax.Array) -> jax.Array:
    """Maps and unit normals as one image `(H, W, 10)`: base colour, metallic, alpha^2, s_x, s_y, s_x^2, s_y^2, s_x s_y.

    Parameters outside their ranges are taken as the nearest valid ones.
    """
    params, slope = clamp(params), slopes_of(normal)
    x, y = slope[..., :1], slope[..., 1:]
    maps = (params.base_color, params.metallic[..., None], params.roughness[..., None] ** 4, slope, x * x, y * y, x * y)
    return jnp.concatenate([jnp.broadcast_to(m, (*normal.shape[:2], m.shape[-1])) for m in maps], axis=-1)


def moments_of(values: jax.Array) -> Moments:
    """Means `(..., 10)` of `pack_slopes`' image as moments."""
    slope = values[..., 5:7]
    x, y = slope[..., 0], slope[..., 1]
    covariance = Tensor(values[..., 7] - x * x, values[..., 8] - y * y, values[..., 9] - x * y)
    return Moments(values[..., :3], values[..., 3], values[..., 4], slope, covariance)


def roughness_of(covariance: Tensor, alpha_squared: jax.Array) -> Tensor:
    """A with A^2 = 2 C + alpha^2, the positive root.

    Of a matrix S of two rows it is (S + d) / sqrt(tr S + 2 d) with d = sqrt(det S), smooth where S is round; det S is
    the sum det 2 C + alpha^2 tr 2 C + alpha^4, positive however thin C is.

    Args:
        covariance: any entries; those of no covariance are taken to the nearest of one, the diagonal first.
        alpha_squared: positive, `(...)`.
    """
    a, b = (2.0 * jnp.maximum(entry, 0.0) for entry in covariance[:2])
    bound = safe_sqrt(a) * safe_sqrt(b)
    c = jnp.clip(2.0 * covariance.c, -bound, bound)
    determinant = jnp.maximum(a * b - c * c, 0.0) + alpha_squared * (a + b + alpha_squared)
    d = jnp.sqrt(determinant)
    scale = 1.0 / jnp.sqrt(a + b + 2.0 * (alpha_squared + d))
    return Tensor((a + alpha_squared + d) * scale, (b + alpha_squared + d) * scale, c * scale)
