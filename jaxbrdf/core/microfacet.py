"""The anisotropic GGX distribution of microfacet normals with Smith's masking and its visible normals.

All of Smith's terms are written with s(w) = sqrt(ax^2 x^2 + ay^2 y^2 + z^2), the length of w stretched by the
roughness. Then Lambda = (s / z - 1) / 2 and no form below divides by a cosine or subtracts near-equal numbers.
Roughness ax, ay lies in [1e-4, 1] and is `()` or of the directions' batch shape.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import dot
from jaxbrdf.core.numerics import safe_divide, safe_normalize, safe_sqrt


def lift(w: jax.Array) -> jax.Array:
    """w with its cosine raised to at least the dtype's epsilon.

    A rounded unit vector's angle is uncertain by that much, and from there on GGX values (at most 1 / (4 pi a^3 eps),
    7e17 in float32 at a = 1e-4) and their gradients (another 1 / (a eps)) stay far from overflow.
    """
    z = jnp.maximum(w[..., 2], jnp.finfo(w.dtype).eps)
    return jnp.concatenate([w[..., :2], z[..., None]], axis=-1)


def stretched_length(w: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array) -> jax.Array:
    """s(w) = sqrt(ax^2 x^2 + ay^2 y^2 + z^2), `(...)`."""
    x, y, z = w[..., 0] * alpha_x, w[..., 1] * alpha_y, w[..., 2]
    return safe_sqrt(x * x + y * y + z * z)


def ggx_density(wh: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array) -> jax.Array:
    """D(wh) = 1 / (pi ax ay (x^2/ax^2 + y^2/ay^2 + z^2)^2) [1/sr] (Heitz 2014, Eq. 85), zero below the horizon.

    It integrates to one against the cosine of wh.
    """
    x, y, z = wh[..., 0] / alpha_x, wh[..., 1] / alpha_y, wh[..., 2]
    spread = x * x + y * y + z * z
    density = 1.0 / (jnp.pi * alpha_x * alpha_y * spread * spread)
    return jnp.where(z > 0, density, 0.0)


def smith_lambda(w: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array) -> jax.Array:
    """Smith's Lambda(w) for z > 0 (Heitz 2014, Eq. 72 and 86), written without the cancellation at small roughness."""
    x, y, z = w[..., 0] * alpha_x, w[..., 1] * alpha_y, w[..., 2]
    return safe_divide(x * x + y * y, 2.0 * z * (z + stretched_length(w, alpha_x, alpha_y)))


def smith_g1(w: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array) -> jax.Array:
    """Visible share of the microfacets that face w: 1 / (1 + Lambda) = 2 z / (z + s)."""
    z = w[..., 2]
    return safe_divide(2.0 * z, z + stretched_length(w, alpha_x, alpha_y))


def smith_g2(wi: jax.Array, wo: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array) -> jax.Array:
    """Height-correlated masking and shadowing: 1 / (1 + Lambda(wi) + Lambda(wo)) (Heitz 2014, Eq. 99)."""
    return 4.0 * wi[..., 2] * wo[..., 2] * visibility(wi, wo, alpha_x, alpha_y)


def visibility(wi: jax.Array, wo: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array) -> jax.Array:
    """G2 / (4 cos_i cos_o) = 1 / (2 (s_i cos_o + s_o cos_i)); grows without bound only where both cosines vanish."""
    s_i, s_o = stretched_length(wi, alpha_x, alpha_y), stretched_length(wo, alpha_x, alpha_y)
    across = s_i * wo[..., 2] + s_o * wi[..., 2]
    return safe_divide(jnp.full_like(across, 0.5), across)


def visible_normal_density(wh: jax.Array, wo: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array) -> jax.Array:
    """Density of the normals visible from wo: G1(wo) D(wh) max(wo . wh, 0) / cos_o [1/sr] (Heitz 2018, Eq. 1)."""
    facing = jnp.maximum(dot(wo, wh), 0.0)
    both = wo[..., 2] + stretched_length(wo, alpha_x, alpha_y)
    return ggx_density(wh, alpha_x, alpha_y) * safe_divide(2.0 * facing, both)


def reflected_density(wh: jax.Array, wo: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array) -> jax.Array:
    """Density of wo mirrored about a visible normal wh: the above / (4 wo . wh) = D / (2 (cos_o + s_o)) [1/sr]."""
    both = wo[..., 2] + stretched_length(wo, alpha_x, alpha_y)
    return safe_divide(0.5 * ggx_density(wh, alpha_x, alpha_y), both)


def sample_visible_normal(wo: jax.Array, alpha_x: jax.Array, alpha_y: jax.Array, u: jax.Array) -> jax.Array:
    """A microfacet normal visible from wo (Dupuy and Benyoub 2023, spherical caps).

    In the space where the surface is a hemisphere of mirrors, light from one direction reflects uniformly into a cap of
    the sphere; a point of that cap gives back the half vector.

    Args:
        wo: `(..., 3)`, above the horizon.
        alpha_x, alpha_y: roughness.
        u: uniform in [0, 1), `(..., 2)`.
    """
    scale = jnp.stack(jnp.broadcast_arrays(alpha_x, alpha_y, jnp.ones_like(wo[..., 0])), axis=-1)
    view = safe_normalize(wo * scale)
    drop = u[..., 1] * (1.0 + view[..., 2])
    sin = safe_sqrt(drop * (2.0 - drop))
    phi = 2.0 * jnp.pi * u[..., 0]
    cap = jnp.stack([sin * jnp.cos(phi), sin * jnp.sin(phi), 1.0 - drop], axis=-1)
    return safe_normalize((cap + view) * scale)
