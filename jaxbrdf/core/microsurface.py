"""The linear map between a microsurface and the standard one, of unit roughness and centred slopes.

With roughness A and mean slope mu, the standard normal m becomes M m and a direction w is seen by it as M^T w:

    M = [[A, -mu], [0, 1]],   det M = det A,   <w, M m> = <M^T w, m>

(Dupuy 2015; Zeltner et al. 2024, Eq. 8). So whatever holds for the standard surface holds for all: densities of slopes
divide by det A, projected areas are those of M^T w, and visible normals are M times the standard one's. A mean slope
of None is not there.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_normalize
from jaxbrdf.core.roughness import Roughness


def standard_view(roughness: Roughness, slope: jax.Array | None, w: jax.Array) -> jax.Array:
    """M^T w, `(..., 3)`, not normalised: w as the standard surface sees it."""
    x, y = roughness.stretch(w[..., 0], w[..., 1])
    z = w[..., 2] if slope is None else w[..., 2] - slope[..., 0] * w[..., 0] - slope[..., 1] * w[..., 1]
    return jnp.stack([x, y, z], axis=-1)


def standard_normal(roughness: Roughness, slope: jax.Array | None, wh: jax.Array) -> jax.Array:
    """M^-1 wh, `(..., 3)`, not normalised: the standard surface's normal that becomes wh."""
    x, y, z = wh[..., 0], wh[..., 1], wh[..., 2]
    if slope is not None:
        x, y = x + slope[..., 0] * z, y + slope[..., 1] * z
    return jnp.stack([*roughness.shrink(x, y), z], axis=-1)


def surface_normal(roughness: Roughness, slope: jax.Array | None, normal: jax.Array) -> jax.Array:
    """M m over its length, `(..., 3)`: inverse of `standard_normal`."""
    x, y = roughness.stretch(normal[..., 0], normal[..., 1])
    z = normal[..., 2]
    if slope is not None:
        x, y = x - slope[..., 0] * z, y - slope[..., 1] * z
    return safe_normalize(jnp.stack([x, y, z], axis=-1))
