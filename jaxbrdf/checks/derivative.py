"""Automatic derivatives against differences of values, in float64, where rounding leaves differences seven digits."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.compiled import values
from jaxbrdf.types import Brdf, Params, Query

STEP = 1e-6
"""Of a direction's components: the difference is off by STEP^2 of a third derivative and 1e-16 / STEP of the value."""

LEAST = 1e-12
"""1/sr; added to f, whose logarithm is then finite."""


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
        wide, wi, wo = _widened((params, *query[:2]))
        turn = np.stack([_tangential(np.asarray(w), a) for w, a in zip((wi, wo), along, strict=True)])
        slope = np.sum(turn * np.asarray(_gradient(brdf, wide, wi, wo)[1:]), axis=(0, -1))
        ahead, behind = (_log_f(brdf, wide, _unit(np.stack([wi, wo]) + step * turn)) for step in (STEP, -STEP))
    return _relative(slope, (ahead - behind) / (2.0 * STEP))


def parameter_mismatch(key: jax.Array, brdf: Brdf, params: Params, query: Query) -> float:
    """Relative difference of the slopes of the mean ln f over the query where every parameter moves by a random share.

    The same arguments as of `derivative_mismatch`.
    """
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)).tolist())
    with jax.enable_x64(True):
        wide, wi, wo = _widened((params, *query[:2]))
        share = jax.tree.map(lambda leaf: np.asarray(leaf) * rng.uniform(-1.0, 1.0, leaf.shape), wide)
        by_params = _gradient(brdf, wide, wi, wo)[0]
        slope = sum(map(np.vdot, jax.tree.leaves(by_params), jax.tree.leaves(share))) / len(wi)
        moved = [jax.tree.map(lambda leaf, part, h=h: leaf + h * part, wide, share) for h in (STEP, -STEP)]
        ahead, behind = (np.mean(_log_f(brdf, own, np.stack([wi, wo]))) for own in moved)
    return float(_relative(np.asarray(slope), np.asarray((ahead - behind) / (2.0 * STEP))))


@jax.jit(static_argnums=0)
def _gradient(brdf: Brdf, params: Params, wi: jax.Array, wo: jax.Array) -> tuple[Params, jax.Array, jax.Array]:
    """Of the sum of ln f by the parameters and by both directions, `(n, 3)` each."""

    def total(params: Params, wi: jax.Array, wo: jax.Array) -> jax.Array:
        return jnp.sum(jnp.log(jnp.sum(brdf.eval(params, Query(wi, wo)), axis=-1) + LEAST))

    # backwards, as training differentiates: some lookups have no other derivative
    return jax.grad(total, argnums=(0, 1, 2), allow_int=True)(params, wi, wo)


def _widened(tree: Any) -> Any:
    """Floating point in double precision; other leaves as they are."""
    wide = lambda leaf: leaf.astype(np.float64) if np.issubdtype(leaf.dtype, np.floating) else leaf  # noqa: E731
    return jax.tree.map(lambda leaf: jnp.asarray(wide(np.asarray(leaf))), tree)


def _relative(slope: np.ndarray, difference: np.ndarray) -> np.ndarray:
    return np.abs(slope - difference) / (np.maximum(np.abs(slope), np.abs(difference)) + 1e-3)


def _unit(w: np.ndarray) -> np.ndarray:
    return w / np.linalg.norm(w, axis=-1, keepdims=True)


def _log_f(brdf: Brdf, params: Params, moved: np.ndarray) -> np.ndarray:
    return np.log(np.sum(values(brdf, params, Query(*map(jnp.asarray, moved))), axis=-1) + LEAST)


def _tangential(w: np.ndarray, along: np.ndarray) -> np.ndarray:
    """The part of `along` that turns w, of length one."""
    return _unit(along - np.sum(along * w, axis=-1, keepdims=True) * w)
