"""The least energy scale that leaves no directional albedo above one.

With c = exp(-s) a viewer at t gets back c(t) A(t), A(t) = integral f c(wi) cos(wi) over wi. The least s >= 0 that keeps
this at most one everywhere is the fixed point s = max(0, log A); s <- (s + max(0, log A)) / 2 goes there. A spline that
is nowhere below it darkens the light more, so its A is smaller, and the bound holds for it all the more; of these
splines the one that darkens least is the solution of a linear programme. What it leaves is then summed by more
lights at eight times as many viewers, and where that is still above one the spline is raised.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import linprog

from jaxbrdf.brdf.albedo_table import AZIMUTHS, ELEVATIONS, table_views, tabulate_albedo
from jaxbrdf.brdf.energy_scale import EnergyScale, log2_loss, scale_terms, scaled
from jaxbrdf.core.grazing import grazing
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.sampling.lights import lights_to_horizon
from jaxbrdf.types import Params, Query

LIGHTS, CHECKED_LIGHTS, ROUGH_LIGHTS = 2**14, 2**15, 2**11
"""Directions to the light that are summed for a viewer, at first and in the end: of fits that grow towards the horizon
the last are off by up to 1.6e-3 (against 2^19). The fewest tell how fast it grows."""
CHECKED_ELEVATIONS = 8 * (ELEVATIONS - 1) + 1
"""The albedo that a spline leaves has peaks between the first viewers."""

MARGIN = 4e-3
"""Kept below one, for the error of the sums; half of it must be left in the end."""

CORRECTIONS = 8
"""Each leaves what the spline's stiffness shifts to other elevations; two or three are enough."""

ROUNDS = 40
CHANGE = 1e-5
"""Of s, below which the iteration has arrived: each round halves what is missing."""


class _Light(NamedTuple):
    """f cos / density over the number of lights, `(V, n, 3)`, and t of each light `(V, n)`, for V viewers."""

    light: jax.Array
    t: jax.Array


def fit_energy_scale(
    evaluate: Callable[[Params, Query], jax.Array], params: Params, *, isotropic: bool, lights: int = LIGHTS
) -> EnergyScale | None:
    """The scale of the reflectance `evaluate(params, query)`; None where no albedo is above 1 - `MARGIN`.

    It depends on elevations alone: of an anisotropic material the brightest of `AZIMUTHS` azimuths counts.
    """
    views = table_views(ELEVATIONS, 1 if isotropic else AZIMUTHS)
    loss = np.asarray(_fixed_point(evaluate, lights, params, views), np.float64)
    loss = np.stack([np.interp(_coordinates(CHECKED_ELEVATIONS), _coordinates(ELEVATIONS), s) for s in loss.T], axis=-1)
    margin = MARGIN + _between(_log_albedo(evaluate, params, isotropic, ROUGH_LIGHTS))
    scaled_evaluate = scaled(evaluate, lambda both: both)
    for _ in range(CORRECTIONS):
        scale = _scale_of(loss)
        beyond = _log_albedo(scaled_evaluate, (params, scale), isotropic, CHECKED_LIGHTS) + margin
        if beyond.max() <= 0.5 * MARGIN:
            break
        loss = np.maximum(loss, np.where(beyond > 0.0, _loss_at_nodes(scale) + beyond, 0.0))
    else:
        # what is left is taken everywhere, so that the bound holds in any case
        scale = _scale_of(_loss_at_nodes(scale) + max(float(beyond.max()), 0.0))
    return scale if loss.any() else None


def _scale_of(loss: np.ndarray) -> EnergyScale:
    return EnergyScale(jnp.asarray(_envelope(loss) / np.log(2.0), jnp.float32))


def _between(log_albedo: np.ndarray) -> np.ndarray:
    """How far an albedo may rise above its neighbouring nodes, `(K, 3)`, of that without the scale.

    Where it ceases to grow between two nodes, after a share x of its step d, and the scale's logarithm falls by e from
    one to the other, the peak is above both by no more than min(x (d - e), (1 - x) e), which is at most d / 4.
    """
    steps = np.abs(np.diff(log_albedo, axis=0))
    return 0.25 * np.maximum(np.append(steps, steps[-1:], axis=0), np.insert(steps, 0, steps[:1], axis=0))


def _log_albedo(
    evaluate: Callable[[Params, Query], jax.Array], params: Params, isotropic: bool, lights: int
) -> np.ndarray:
    """At the checked elevations, of the brightest azimuth, `(K, 3)`."""
    table = tabulate_albedo(evaluate, params, isotropic=isotropic, elevations=CHECKED_ELEVATIONS, lights=lights)
    return np.log(np.maximum(np.asarray(table.values, np.float64).max(axis=0), 1e-6))


def _loss_at_nodes(scale: EnergyScale) -> np.ndarray:
    """-ln c at the checked elevations, `(K, 3)`."""
    return np.log(2.0) * np.asarray(log2_loss(scale, table_views(CHECKED_ELEVATIONS, 1)[0]), np.float64)


def _coordinates(count: int) -> np.ndarray:
    """t of a table's elevations."""
    return np.minimum(np.linspace(0.0, 1.0, count), float(grazing(jnp.zeros(3))))


@partial(jax.jit, static_argnums=(0, 1))
def _fixed_point(
    evaluate: Callable[[Params, Query], jax.Array], lights: int, params: Params, views: jax.Array
) -> jax.Array:
    """s at the elevations of `views` `(P, K, 3)`, `(K, 3)`."""

    def of_view(wo: jax.Array) -> _Light:
        wi, density = lights_to_horizon(wo, lights)
        f = evaluate(params, Query(wi, jnp.broadcast_to(wo, wi.shape)))
        return _Light(f * safe_divide(jnp.maximum(wi[:, 2], 0.0), density * lights)[:, None], grazing(wi))

    turns, elevations, _ = views.shape
    light, t = jax.lax.map(of_view, views.reshape(-1, 3))
    step = t * (elevations - 1)
    low = jnp.clip(jnp.floor(step), 0, elevations - 2)
    k, along = low.astype(jnp.int32), (step - low)[..., None]

    def log_albedo(s: jax.Array) -> jax.Array:
        c = jnp.exp(-(s[k] * (1.0 - along) + s[k + 1] * along))
        total = jnp.sum(light * c, axis=1).reshape(turns, elevations, 3)
        return jnp.log(jnp.maximum(jnp.max(total, axis=0), 1e-6)) + MARGIN

    def goes_on(state: tuple[jax.Array, jax.Array, jax.Array]) -> jax.Array:
        return (state[0] < ROUNDS) & (state[1] > CHANGE)

    def halfway(state: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array, jax.Array]:
        count, _, s = state
        after = 0.5 * (s + jnp.maximum(log_albedo(s), 0.0))
        return count + 1, jnp.max(jnp.abs(after - s)), after

    return jax.lax.while_loop(goes_on, halfway, (jnp.int32(0), jnp.float32(1.0), jnp.zeros((elevations, 3))))[2]


def _envelope(loss: np.ndarray) -> np.ndarray:
    """Weights `(TERMS, 3)` of the spline of least mean that is nowhere below `loss` `(K, 3)` nor below zero."""
    t = _coordinates(len(loss))
    between = np.linspace(0.0, 1.0, 4 * (len(loss) - 1) + 1)
    terms = np.asarray(scale_terms(jnp.asarray(between)), np.float64)
    weights = []
    for channel in loss.T:
        least = np.interp(between, t, channel)
        # cos dwi is what a uniform surrounding weighs an elevation with; nowhere nothing
        share = np.gradient(-((1.0 - between) ** 8)) + 1e-4
        found = linprog(share @ terms, A_ub=-terms, b_ub=-least, bounds=(None, None), method="highs")
        weights.append(found.x)
    return np.stack(weights, axis=-1)
