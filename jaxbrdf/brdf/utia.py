"""UTIA tables (Filip and Vavra 2014) as an anisotropic BRDF, interpolated linearly in all four angles."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.cosine_sampler import cosine_sampled
from jaxbrdf.core.arctangent import fast_atan2
from jaxbrdf.core.directions import above_horizon, cos_theta, sin_theta
from jaxbrdf.core.staging import staged
from jaxbrdf.data.utia import PHIS, THETAS, Utia
from jaxbrdf.types import Material, Query

STEPS_PER_RADIAN = (12.0 / jnp.pi, 24.0 / jnp.pi)
"""Of theta, every 15 degrees, and of phi, every 7.5."""


class UtiaParams(NamedTuple):
    """Attributes:
    rgb: the table, `(6, 48, 6, 48, 3)` over theta_i, phi_i, theta_v, phi_v.
    """

    rgb: jax.Array


class Bracket(NamedTuple):
    """Two entries of one side's 288 and their weights, for theta and phi together: four pairs of `(...)` arrays."""

    index: tuple[jax.Array, ...]
    weight: tuple[jax.Array, ...]


def material(table: Utia, name: str) -> Material:
    """A table as a material; light is drawn by cosine."""
    return Material(name, BRDF, UtiaParams(jnp.asarray(table.rgb, jnp.float32)), False)


def evaluate(tables: UtiaParams, query: Query) -> jax.Array:
    """f(wi, wo), `(..., 3)`; what interpolates to less than zero becomes zero."""
    return jnp.maximum(unclamped(tables, query), 0.0)


def unclamped(tables: UtiaParams, query: Query) -> jax.Array:
    """f(wi, wo) as interpolated, `(..., 3)`; zero below the horizon.

    Above 75 degrees, where the measurements end, the line through 60 and 75 goes on, as in the database's own code.
    """
    light, viewer = staged((_bracket(query.wi), _bracket(query.wo)))
    flat = tables.rgb.reshape(-1, 3)
    total = jnp.zeros(())
    for i, wi in zip(light.index, light.weight, strict=True):
        for v, wv in zip(viewer.index, viewer.weight, strict=True):
            total = total + flat.at[i * (THETAS * PHIS) + v].get(mode="promise_in_bounds") * (wi * wv)[..., None]
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], total, 0.0)


def _bracket(w: jax.Array) -> Bracket:
    theta = fast_atan2(sin_theta(w), cos_theta(w)) * STEPS_PER_RADIAN[0]
    phi = fast_atan2(w[..., 1], w[..., 0]) * STEPS_PER_RADIAN[1]
    row, turn = jnp.clip(theta.astype(jnp.int32), 0, THETAS - 2), jnp.floor(phi)
    up, around = theta - row, phi - turn
    column = turn.astype(jnp.int32) % PHIS
    pairs = [
        ((row + i) * PHIS + (column + k) % PHIS, a * b)
        for i, a in ((0, 1.0 - up), (1, up))
        for k, b in ((0, 1.0 - around), (1, around))
    ]
    return Bracket(tuple(i for i, _ in pairs), tuple(w for _, w in pairs))


BRDF = cosine_sampled(evaluate)
"""The pure functions of every UTIA material."""
