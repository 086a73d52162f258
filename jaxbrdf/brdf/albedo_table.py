"""The directional albedo of any reflectance, summed once and looked up: nodes in the viewer's elevation and azimuth."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import azimuth
from jaxbrdf.core.grazing import grazing, view_at
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.sampling.lights import lights_to_horizon
from jaxbrdf.types import Params, Query

LIGHTS = 2**15
"""Directions to the light that are summed for a viewer: of fits that grow towards the horizon off by up to 1.6e-3, by
sixteen times as many (the error falls with their number)."""

ELEVATIONS = 33
AZIMUTHS = 16
"""Of an anisotropic material; an isotropic one has one."""


class AlbedoTable(NamedTuple):
    """values: integral of f cos(wi) over wi for R, G and B, `(P, K, 3)`.

    P azimuths of the viewer in equal steps from zero and K elevations in equal steps of t (`jaxbrdf.core.grazing`) from
    the normal to the horizon, where the light of `LEAST_COSINE` counts.
    """

    values: jax.Array


def tabulate_albedo(
    evaluate: Callable[[Params, Query], jax.Array],
    params: Params,
    *,
    isotropic: bool,
    elevations: int = ELEVATIONS,
    lights: int = LIGHTS,
) -> AlbedoTable:
    """The albedo of the reflectance `evaluate(params, query)` at the table's viewers."""
    views = table_views(elevations, 1 if isotropic else AZIMUTHS)
    return AlbedoTable(_albedo_of_views(evaluate, lights, params, views))


def table_views(elevations: int, azimuths: int) -> jax.Array:
    """The viewers that a table's nodes stand for, `(P, K, 3)`."""
    t = jnp.linspace(0.0, 1.0, elevations)
    phi = jnp.arange(azimuths) * (2.0 * jnp.pi / azimuths)
    # at the horizon itself nothing is lit
    t, phi = jnp.broadcast_arrays(jnp.minimum(t, grazing(jnp.zeros(3)))[None], phi[:, None])
    return view_at(t, phi)


def albedo_at(table: AlbedoTable, wo: jax.Array) -> jax.Array:
    """The albedo for viewers `(..., 3)`, `(..., 3)`: linear between nodes, zero below the horizon."""
    turns, elevations, _ = table.values.shape
    step = grazing(wo) * (elevations - 1)
    k, along = _cell(step, elevations - 2)
    turn = azimuth(wo) * (turns / (2.0 * jnp.pi))
    before = jnp.floor(turn)
    j, across = jnp.mod(before, turns).astype(jnp.int32), (turn - before)[..., None]

    def at_azimuth(j: jax.Array) -> jax.Array:
        return table.values[j, k] * (1.0 - along) + table.values[j, k + 1] * along

    albedo = at_azimuth(j) * (1.0 - across) + at_azimuth((j + 1) % turns) * across
    return jnp.where(wo[..., 2:] > 0, albedo, 0.0)


def _cell(step: jax.Array, last: int) -> tuple[jax.Array, jax.Array]:
    low = jnp.clip(jnp.floor(step), 0, last)
    return low.astype(jnp.int32), (step - low)[..., None]


@partial(jax.jit, static_argnums=(0, 1))
def _albedo_of_views(
    evaluate: Callable[[Params, Query], jax.Array], lights: int, params: Params, views: jax.Array
) -> jax.Array:
    def of_view(wo: jax.Array) -> jax.Array:
        wi, density = lights_to_horizon(wo, lights)
        f = evaluate(params, Query(wi, jnp.broadcast_to(wo, wi.shape)))
        return jnp.mean(f * safe_divide(jnp.maximum(wi[:, 2], 0.0), density)[:, None], axis=0)

    flat = jax.lax.map(of_view, views.reshape(-1, 3))
    return flat.reshape(*views.shape[:-1], 3)
