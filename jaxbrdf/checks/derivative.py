"""Automatic derivatives against differences of values, in float64, where rounding leaves differences seven digits."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.types import Brdf, Params, Query

STEP = 1e-6
"""Of a direction's components: the difference is off by STEP^2 of a third derivative and 1e-16 / STEP of the value."""


def derivative_mismatch(key: jax.Array, brdf: Brdf, params: Params, query: Query) -> np.ndarray:
    """Relative differences of the slopes of ln f along a random turn of both directions, `(n,)`.

    Args:
        key: chooses the turns.
        brdf: the reflectance.
        params: in any precision.
        query: ordinary pairs `(n, 3)`, away from horizons and poles.
    """
    along = np.asarray(jax.random.normal(key, (2, *query.wi.shape)), np.float64)
    with jax.enable_x64(True):
        wide = jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf, np.float64)), (params, query.wi, query.wo))
        tangent = [jnp.asarray(_tangential(np.asarray(w), a)) for w, a in zip(wide[1:], along, strict=True)]
        slope, difference = jax.jit(partial(_slopes, brdf))(*wide, *tangent)
        size = jnp.maximum(jnp.abs(slope), jnp.abs(difference)) + 1e-3
        return np.asarray(jnp.abs(slope - difference) / size)


def _slopes(
    brdf: Brdf, params: Params, wi: jax.Array, wo: jax.Array, along_i: jax.Array, along_o: jax.Array
) -> tuple[jax.Array, jax.Array]:
    def log_f(t: jax.Array) -> jax.Array:
        f = brdf.eval(params, Query(_moved(wi, along_i, t), _moved(wo, along_o, t)))
        return jnp.log(jnp.sum(f, axis=-1) + 1e-12)

    still = jnp.zeros_like(wi[..., 0])
    # backwards, as training differentiates: some lookups have no other derivative
    slope = jax.grad(lambda t: jnp.sum(log_f(t)))(still)
    return slope, (log_f(still + STEP) - log_f(still - STEP)) / (2.0 * STEP)


def _moved(w: jax.Array, along: jax.Array, t: jax.Array) -> jax.Array:
    moved = w + t[..., None] * along
    return moved / jnp.linalg.norm(moved, axis=-1, keepdims=True)


def _tangential(w: np.ndarray, along: np.ndarray) -> np.ndarray:
    """The part of `along` that turns w, of length one."""
    across = along - np.sum(along * w, axis=-1, keepdims=True) * w
    return across / np.linalg.norm(across, axis=-1, keepdims=True)
