"""Directional albedo by another rule than the package's: Gauss-Legendre rings about the mirrored viewer."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.types import Params, Query

RINGS, SECTORS = 96, 512
LEAST_ANGLE = 1e-5
"""Radian about the mirrored viewer, within which nothing is summed."""


def albedo_by_rings(
    evaluate: Callable[[Params, Query], jax.Array],
    params: Params,
    wo: np.ndarray,
    *,
    rings: int = RINGS,
    sectors: int = SECTORS,
) -> np.ndarray:
    """Integral of f cos(wi) over wi for one viewer, `(3,)` in float64; as many rings in each decade of the angle.

    Gauss and Legendre's rule in the angle's logarithm, the trapezium's around; the horizon cuts through the last rings,
    which leaves an error like one over the number of sectors there.
    """
    mirror = wo * [-1.0, -1.0, 1.0]
    across = np.cross(mirror, [0.0, 1.0, 0.0] if abs(mirror[1]) < 0.9 else [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    x, weight = np.polynomial.legendre.leggauss(rings)
    low, high = np.log(LEAST_ANGLE), np.log(np.pi)
    angle = np.exp(low + 0.5 * (x + 1.0) * (high - low))[:, None]
    phi = (np.arange(sectors) + 0.5)[None] * (2.0 * np.pi / sectors)
    local = np.stack([np.sin(angle) * np.cos(phi), np.sin(angle) * np.sin(phi), np.cos(angle) + 0.0 * phi], axis=-1)
    wi = local @ np.stack([across, np.cross(mirror, across), mirror])
    share = np.sin(angle) * angle * (0.5 * (high - low) * weight[:, None]) * (2.0 * np.pi / sectors)
    flat = jnp.asarray(wi.reshape(-1, 3), jnp.float32)
    f = np.asarray(_values(evaluate, params, Query(flat, jnp.broadcast_to(jnp.asarray(wo, jnp.float32), flat.shape))))
    lit = np.maximum(wi[..., 2], 0.0) * share
    return np.einsum("nc,n->c", f.astype(float), lit.ravel())


@partial(jax.jit, static_argnums=0)
def _values(evaluate: Callable[[Params, Query], jax.Array], params: Params, query: Query) -> jax.Array:
    return evaluate(params, query)
