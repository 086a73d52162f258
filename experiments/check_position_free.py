"""Compare the position-free estimator with light particles traced through the same stacks, and write the z-scores.

Usage: python experiments/check_position_free.py [OUTPUT.json]

The tracing is written apart from the package, in numpy and float64: every event is drawn as it happens (analog), there
is no next-event estimation and no weight, a particle has one channel, and where it leaves is counted in cells of equal
projected solid angle. The estimator answers the opposite question, f for viewers drawn in those cells.
"""

from __future__ import annotations

import json
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams
from jaxbrdf.brdf.position_free import StackParams, position_free
from jaxbrdf.brdf.rough_interface import InterfaceParams
from jaxbrdf.core.fresnel import Conductor
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.medium import Medium
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.types import Brdf, Query

OUTPUT = Path(__file__).parent / "results" / "position_free.json"
PARTICLES = 600_000
VIEWERS = 8192
RINGS, SECTORS = 4, 4
SEED = 0
GOLD = ((0.223, 0.428, 1.335), (3.204, 2.460, 1.872))
SILVER = ((0.055, 0.054, 0.043), (4.450, 3.546, 2.588))
CLAY, WHITE = (0.8, 0.5, 0.2), (1.0, 1.0, 1.0)


class Layer(NamedTuple):
    """An interface of GGX roughness and relative index, and what lies below it: optical depths, mean cosine."""

    alpha: float
    eta: float
    absorption: tuple[float, float, float] | None = None
    scattering: tuple[float, float, float] | None = None
    asymmetry: float | None = None


class Metal(NamedTuple):
    """A rough conductor: roughness and complex index for R, G and B."""

    alpha: float
    eta: tuple[float, float, float]
    k: tuple[float, float, float]


class Stack(NamedTuple):
    """Layers from the top over a base, which is a metal or a diffuse albedo; the light's angle in radians."""

    layers: tuple[Layer, ...]
    base: Metal | tuple[float, float, float]
    theta: float


HAZE = (0.3, 0.6, 1.2)
TINT = (0.1, 0.4, 1.0)
STACKS = {
    "smooth coat, clay": Stack((Layer(0.05, 1.5),), CLAY, 0.6),
    "rough coat, clay": Stack((Layer(0.3, 1.5),), CLAY, 0.6),
    "rough coat, clay, grazing": Stack((Layer(0.3, 1.5),), CLAY, 1.3),
    "very rough coat, white": Stack((Layer(0.8, 1.5),), WHITE, 0.3),
    "dense coat, white": Stack((Layer(0.2, 2.4),), WHITE, 0.9),
    "rare coat, clay": Stack((Layer(0.3, 0.8),), CLAY, 0.5),
    "rough coat, gold": Stack((Layer(0.2, 1.5),), Metal(0.3, *GOLD), 0.7),
    "rough coat, smooth gold": Stack((Layer(0.4, 1.5),), Metal(0.1, *GOLD), 0.4),
    "smooth coat, rough silver": Stack((Layer(0.1, 1.33),), Metal(0.6, *SILVER), 1.0),
    "dense coat, silver": Stack((Layer(0.3, 2.0),), Metal(0.3, *SILVER), 1.2),
    "tinted coat, clay": Stack((Layer(0.1, 1.5, TINT),), CLAY, 0.6),
    "tinted coat, white, grazing": Stack((Layer(0.4, 1.5, TINT),), WHITE, 1.3),
    "tinted coat, gold": Stack((Layer(0.2, 1.5, TINT),), Metal(0.2, *SILVER), 0.8),
    "hazy coat, clay": Stack((Layer(0.1, 1.5, TINT, HAZE, 0.5),), CLAY, 0.6),
    "hazy coat forwards, white": Stack((Layer(0.3, 1.5, TINT, HAZE, 0.9),), WHITE, 1.0),
    "dusty coat backwards, clay": Stack((Layer(0.2, 1.33, TINT, HAZE, -0.4),), CLAY, 0.2),
    "milk, black": Stack((Layer(0.2, 1.33, (0.01, 0.1, 0.5), (4.0, 3.0, 2.0), 0.7),), (0.0, 0.0, 0.0), 0.7),
    "hazy coat, gold": Stack((Layer(0.2, 1.5, TINT, HAZE, 0.3),), Metal(0.3, *GOLD), 0.5),
    "two coats, clay": Stack((Layer(0.2, 1.5, TINT), Layer(0.3, 1.2)), CLAY, 0.8),
    "two coats, the lower rarer, clay": Stack((Layer(0.3, 1.7, TINT), Layer(0.2, 0.75)), CLAY, 0.4),
}


def dielectric_reflectance(cos: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Mean of both polarisations' Fresnel equations, with the refracted angle by Snell."""
    sin_t = np.sqrt(np.maximum(1 - cos**2, 0)) / eta
    cos_t = np.sqrt(np.maximum(1 - sin_t**2, 0))
    across = (cos - eta * cos_t) / (cos + eta * cos_t)
    along = (eta * cos - cos_t) / (eta * cos + cos_t)
    return np.where(sin_t >= 1, 1.0, 0.5 * (across**2 + along**2))


def conductor_reflectance(cos: np.ndarray, index: np.ndarray) -> np.ndarray:
    """The same for a complex index."""
    cos_t = np.sqrt(1 - (1 - cos**2) / index**2)
    across = (cos - index * cos_t) / (cos + index * cos_t)
    along = (index * cos - cos_t) / (index * cos + cos_t)
    return 0.5 * (np.abs(across) ** 2 + np.abs(along) ** 2)


def smith_lambda(w: np.ndarray, alpha: float) -> np.ndarray:
    tan_squared = (1 - w[:, 2] ** 2) / w[:, 2] ** 2
    return 0.5 * (np.sqrt(1 + alpha**2 * tan_squared) - 1)


def visible_normal(rng: np.random.Generator, w: np.ndarray, alpha: float) -> np.ndarray:
    """GGX normals as w, above, sees them: a stretched disk halved by the view's plane (Heitz 2018)."""
    stretched = w * [alpha, alpha, 1.0]
    stretched /= np.linalg.norm(stretched, axis=-1, keepdims=True)
    flat = np.hypot(stretched[:, 0], stretched[:, 1])
    safe = np.where(flat > 0, flat, 1.0)
    first = np.stack([-stretched[:, 1] / safe, stretched[:, 0] / safe, np.zeros(len(w))], -1)
    first = np.where(flat[:, None] > 0, first, [1.0, 0.0, 0.0])
    second = np.cross(stretched, first)
    radius, turn = np.sqrt(rng.random(len(w))), 2 * np.pi * rng.random(len(w))
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    half = 0.5 * (1 + stretched[:, 2])
    y = (1 - half) * np.sqrt(1 - x**2) + half * y
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    normal = x[:, None] * first + y[:, None] * second + z[:, None] * stretched
    normal *= [alpha, alpha, 1.0]
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def cross_interface(rng: np.random.Generator, layer: Layer, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where particles go, and which of them do (the rest is stopped by other facets)."""
    side = np.sign(w[:, 2:])
    view, eta = w * side, np.where(side[:, 0] > 0, layer.eta, 1 / layer.eta)
    normal = visible_normal(rng, view, layer.alpha)
    cos = np.clip((view * normal).sum(-1), 0, 1)
    back = rng.random(len(w)) < dielectric_reflectance(cos, eta)
    mirrored = 2 * cos[:, None] * normal - view
    cos_t = np.sqrt(np.maximum(1 - (1 - cos**2) / eta**2, 0))
    refracted = (cos / eta - cos_t)[:, None] * normal - view / eta[:, None]
    out = np.where(back[:, None], mirrored, refracted)
    here, there = smith_lambda(view, layer.alpha), smith_lambda(out, layer.alpha)
    chance = np.where(back, (1 + here) / (1 + here + there), 1 / (1 + there))
    right = np.where(back, out[:, 2] > 0, out[:, 2] < 0)
    return out * side, right & (rng.random(len(w)) < chance)


def meet_base(rng: np.random.Generator, stack: Stack, w: np.ndarray, channel: np.ndarray):
    if not isinstance(stack.base, Metal):
        radius, turn = np.sqrt(rng.random(len(w))), 2 * np.pi * rng.random(len(w))
        out = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - radius**2)], -1)
        return out, rng.random(len(w)) < np.asarray(stack.base)[channel]
    normal = visible_normal(rng, w, stack.base.alpha)
    cos = np.clip((w * normal).sum(-1), 0, 1)
    out = 2 * cos[:, None] * normal - w
    index = (np.asarray(stack.base.eta) + 1j * np.asarray(stack.base.k))[channel]
    here, there = smith_lambda(w, stack.base.alpha), smith_lambda(out, stack.base.alpha)
    chance = conductor_reflectance(cos, index) * (1 + here) / (1 + here + there)
    return out, (out[:, 2] > 0) & (rng.random(len(w)) < chance)


def scattered_direction(rng: np.random.Generator, forward: np.ndarray, g: float) -> np.ndarray:
    u, turn = rng.random(len(forward)), 2 * np.pi * rng.random(len(forward))
    mu = 2 * u - 1 if g == 0 else (1 + g**2 - ((1 - g**2) / (1 - g + 2 * g * u)) ** 2) / (2 * g)
    first = np.cross(forward, np.eye(3)[np.argmin(np.abs(forward), -1)])
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    second, sin = np.cross(forward, first), np.sqrt(1 - mu**2)
    return mu[:, None] * forward + (sin * np.cos(turn))[:, None] * first + (sin * np.sin(turn))[:, None] * second


def cross_medium(rng: np.random.Generator, layer: Layer, w: np.ndarray, channel: np.ndarray):
    """From a boundary along w until a boundary: direction of travel there, and which particles arrive."""
    absorbing, scattering = (np.asarray(x or (0.0, 0.0, 0.0))[channel] for x in (layer.absorption, layer.scattering))
    total = absorbing + scattering
    depth, alive, w = np.where(w[:, 2] > 0, 1.0, 0.0), np.ones(len(w), bool), w.copy()
    flying = alive.copy()
    while flying.any():
        index = np.flatnonzero(flying)
        step = rng.exponential(size=len(index)) / np.maximum(total[index], 1e-300)
        reached = depth[index] - step * w[index, 2]
        left = (reached <= 0) | (reached >= 1)
        flying[index[left]] = False
        hit = index[~left]
        depth[hit] = reached[~left]
        lost = rng.random(len(hit)) * total[hit] < absorbing[hit]
        alive[hit[lost]] = flying[hit[lost]] = False
        on = hit[~lost]
        w[on] = scattered_direction(rng, w[on], layer.asymmetry or 0.0)
    return w, alive


def trace(rng: np.random.Generator, stack: Stack, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions of the particles that leave the stack, with their channels, and the number sent in each channel."""
    channel = rng.integers(0, 3, count)
    sent = np.bincount(channel, minlength=3)
    w = np.tile([np.sin(stack.theta), 0.0, np.cos(stack.theta)], (count, 1))
    place, out, colours = np.zeros(count, int), [], []
    while len(w):
        onward, alive = np.empty_like(w), np.zeros(len(w), bool)
        for at in range(len(stack.layers) + 1):
            here = np.flatnonzero(place == at)
            is_base = at == len(stack.layers)
            met = (
                meet_base(rng, stack, w[here], channel[here])
                if is_base
                else cross_interface(rng, stack.layers[at], w[here])
            )
            onward[here], alive[here] = met
        left = alive & (place == 0) & (onward[:, 2] > 0)
        out.append(onward[left])
        colours.append(channel[left])
        on = alive & ~left
        onward, place, channel = onward[on], place[on], channel[on]
        region = np.where(onward[:, 2] < 0, place, place - 1)
        arrived = np.ones(len(onward), bool)
        for at, layer in enumerate(stack.layers):
            inside = np.flatnonzero(region == at)
            onward[inside], arrived[inside] = cross_medium(rng, layer, onward[inside], channel[inside])
        place = np.where(onward[:, 2] < 0, region + 1, region)[arrived]
        w, channel = -onward[arrived], channel[arrived]
    return np.concatenate(out), np.concatenate(colours), sent


def counted(w: np.ndarray, channel: np.ndarray, sent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of what was sent that leave through each cell, `(cells, 3)`, and their standard errors."""
    ring = np.minimum((RINGS * (1 - w[:, 2] ** 2)).astype(int), RINGS - 1)
    sector = (SECTORS * (np.arctan2(w[:, 1], w[:, 0]) / (2 * np.pi) % 1)).astype(int) % SECTORS
    cell = (ring * SECTORS + sector) * 3 + channel
    share = np.bincount(cell, minlength=RINGS * SECTORS * 3).reshape(-1, 3) / sent
    return share, np.sqrt(np.maximum(share * (1 - share), 1 / sent) / sent)


def cell_viewers(rng: np.random.Generator, count: int) -> np.ndarray:
    """Directions uniform in the projected solid angle of each cell, `(cells, count, 3)`."""
    ring, sector = np.divmod(np.arange(RINGS * SECTORS)[:, None], SECTORS)
    radius = np.sqrt((ring + rng.random((RINGS * SECTORS, count))) / RINGS)
    turn = 2 * np.pi * (sector + rng.random((RINGS * SECTORS, count))) / SECTORS
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1 - radius**2)], -1)


def params_of(stack: Stack) -> tuple[Brdf, StackParams]:
    """The package's own description of the stack."""
    array = lambda x: None if x is None else jnp.asarray(x, jnp.float32)  # noqa: E731
    interfaces = [InterfaceParams(Ggx(Isotropic(array(layer.alpha))), array(layer.eta)) for layer in stack.layers]
    media = [None if layer[2] is None else Medium(*map(array, layer[2:])) for layer in stack.layers]
    if isinstance(stack.base, Metal):
        facets = Ggx(Isotropic(array(stack.base.alpha)))
        metal = MicrofacetParams(facets, Conductor(array(stack.base.eta), array(stack.base.k)))
        return MICROFACET, StackParams(tuple(interfaces), tuple(media), metal)
    return LAMBERT, StackParams(tuple(interfaces), tuple(media), LambertParams(array(stack.base)))


@cache
def noisy_eval_of(base: Brdf):
    return jax.jit(position_free(base).noisy_eval)


def estimated(seed: int, stack: Stack, viewers: int) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of f cos over the cells by the estimator, one walk for each viewer, and their standard errors.

    Every channel has viewers of its own, so that the z-scores are independent.
    """
    base, params = params_of(stack)
    wo = jnp.asarray(cell_viewers(np.random.default_rng(seed), 3 * viewers), jnp.float32)
    wi = jnp.array([np.sin(stack.theta), 0.0, np.cos(stack.theta)], jnp.float32)
    f = noisy_eval_of(base)(jax.random.key(seed), params, Query(jnp.broadcast_to(wi, wo.shape), wo))
    light = np.asarray(f, float).reshape(-1, 3, viewers, 3)[:, range(3), :, range(3)] * np.pi / (RINGS * SECTORS)
    return light.mean(2).T, light.std(2).T / np.sqrt(viewers - 1)


def z_scores(stack: Stack, *, seed: int, particles: int, viewers: int) -> np.ndarray:
    """Differences over their standard errors, `(cells, 3)`."""
    want, error = counted(*trace(np.random.default_rng(seed), stack, particles))
    found, noise = estimated(seed, stack, viewers)
    return (found - want) / np.hypot(error, noise)


def main() -> None:
    output = Path(sys.argv[1]) if len(sys.argv) > 1 else OUTPUT
    table = {}
    for seed, (name, stack) in enumerate(STACKS.items(), SEED):
        z = z_scores(stack, seed=seed, particles=PARTICLES, viewers=VIEWERS)
        p_value = float(stats.chi2.sf(np.square(z).sum(), z.size))
        table[name] = {
            "stack": {"layers": [layer._asdict() for layer in stack.layers], "base": stack.base, "theta": stack.theta},
            "largest |z|": round(float(np.abs(z).max()), 2),
            "share within 3": round(float(np.mean(np.abs(z) < 3)), 4),
            "chi-square p": round(p_value, 4),
            "z": np.round(z, 2).tolist(),
        }
        print(f"{name:34} largest |z| {np.abs(z).max():.2f}  p {p_value:.3f}", flush=True)
    report = {"particles": PARTICLES, "viewers in a cell": VIEWERS, "cells": [RINGS, SECTORS], "stacks": table}
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(json.dumps(report) + "\n")


if __name__ == "__main__":
    main()
