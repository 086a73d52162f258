"""Make the tables of `jaxbrdf.brdf.microfacet_loss`.

    python experiments/derive_microfacet_albedo.py [jaxbrdf/brdf/microfacet_loss.npz]

Takes minutes. Prints the quadrature's own error (against twice the nodes), and that of interpolated losses and means at
random places between the tables' entries.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.microfacet_loss import NAMES, LossTable, Seen, loss_scale, seen_roughness, table_loss
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import ROUGHNESS, Axes
from jaxbrdf.core.smith import correlated_visibility

ISOTROPIC = (97, 33)
GENERAL = (41, 13, 13, 4)
ISOTROPIC_MEAN = 129
GENERAL_MEAN = (65, 17)
LEAST = 1e-2
"""Where the loss at grazing, of which the tables hold the limit, is taken."""

THIN = 1.0 - 1e-8
"""Most of mixing: the ellipse of 1e-4:1."""

CHUNK = 64
NODES = (64, 40)
"""Radial, and in each quarter of the circle."""


class Place(NamedTuple):
    """Where a loss is taken: roughness along the axes, and a view by cosine and azimuth."""

    alpha_x: np.ndarray
    alpha_y: np.ndarray
    mu: np.ndarray
    phi: np.ndarray


def unit_gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1.0), 0.5 * weights


def circle(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Angles from -pi to pi, dense about -pi / 2 and pi / 2, with weights of sum one."""
    points, weights = unit_gauss(count)
    quarter, mass = 0.5 * np.pi * points**3, 0.75 * weights * points**2
    angles = [sign * 0.5 * np.pi + turn * quarter for sign in (-1, 1) for turn in (-1, 1)]
    return np.concatenate(angles), np.tile(mass, 4)


def exact_loss(kind: type, place: Place, *, nodes: tuple[int, int] = NODES) -> np.ndarray:
    """1 - E by quadrature over slopes (E is the integral of f cos_i over wi, wi the mirror image of w about a facet).

    A standard slope r (cos psi, sin psi) lights the surface for r below a root of a quadratic; there the share y of
    slopes that are steeper goes from y(root) to 1, by Gauss-Legendre's nodes.
    """
    parts = [Place(*(x[i : i + CHUNK] for x in place)) for i in range(0, len(place.mu), CHUNK)]
    return np.concatenate([1.0 - _albedo(kind, part, nodes) for part in parts])


def _albedo(kind: type, place: Place, nodes: tuple[int, int]) -> np.ndarray:
    alpha_x, alpha_y, mu, phi = (np.asarray(x, float)[:, None, None] for x in place)
    sin = np.sqrt((1.0 - mu) * (1.0 + mu))
    wx, wy = sin * np.cos(phi), sin * np.sin(phi)
    turn, mass = circle(nodes[1])
    psi = np.arctan2(alpha_y * wy, alpha_x * wx) + turn
    dx, dy = alpha_x * np.cos(psi), alpha_y * np.sin(psi)
    squared, tilt = dx * dx + dy * dy, wx * dx + wy * dy
    root = np.sqrt(tilt * tilt + mu * mu * squared)
    end = np.where(tilt > 0, (tilt + root) / (mu * squared), mu / np.where(tilt > 0, 1.0, root - tilt))
    points, weights = unit_gauss(nodes[0])
    flat = (points * points * (3.0 - 2.0 * points))[:, None]
    r, inside = _radii(kind, end, flat)
    x, y = r * dx, r * dy
    facing, length = mu + wx * x + wy * y, 1.0 + x * x + y * y
    wi = np.stack([2 * facing * x / length - wx, 2 * facing * y / length - wy, 2 * facing / length - mu], axis=-1)
    wo = np.stack(np.broadcast_arrays(wx, wy, mu), axis=-1)
    four = 4.0 * np.asarray(_visibility(kind, alpha_x, alpha_y, jnp.asarray(wi), jnp.asarray(wo)))
    density = inside * (6.0 * weights * points * (1.0 - points))[:, None] * mass
    return np.sum(density * facing * np.maximum(wi[..., 2], 0.0) * four, axis=(-1, -2))


def _radii(kind: type, end: np.ndarray, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Radii at the share `flat` of the mass from `end` down to zero, and that mass."""
    if kind is Ggx:
        inside = end**2 / (1.0 + end**2)
        steeper = 1.0 / (1.0 + end**2) + inside * flat
        return np.sqrt(inside * (1.0 - flat) / steeper), inside
    inside = -np.expm1(-(end**2))
    less = inside * (1.0 - flat)
    half = less < 0.5
    log = np.where(half, np.log1p(-np.where(half, less, 0.0)), np.log(np.exp(-(end**2)) + inside * flat))
    return np.sqrt(-log), inside


@partial(jax.jit, static_argnums=0)
def _visibility(kind: type, alpha_x: jax.Array, alpha_y: jax.Array, wi: jax.Array, wo: jax.Array) -> jax.Array:
    return correlated_visibility(kind(Axes(alpha_x, alpha_y)), wi, wo)


def place_of(share: np.ndarray, along: np.ndarray, across: np.ndarray, mixing: np.ndarray) -> Place:
    """Where the tables' coordinates are."""
    squared = share * share
    mu = np.minimum(squared * along / (1.0 + along - squared), 1.0)
    p, r = along**2, across**2
    mixed = np.sqrt(mixing * p * r)
    larger = 0.5 * (p + r + np.hypot(p - r, 2.0 * mixed))
    phi = 0.5 * np.arctan2(2.0 * mixed, p - r)
    return Place(np.sqrt(larger), np.sqrt(p * r * (1.0 - mixing) / larger), mu, phi)


def share_table(kind: type, shape: tuple[int, ...]) -> np.ndarray:
    """1 - E over `loss_scale` on the regular grid, of two (isotropic) or four coordinates."""
    sides = [np.linspace(0.0, 1.0, count) for count in shape]
    grid = [x.ravel() for x in np.meshgrid(*sides, indexing="ij")]
    share, along = np.maximum(grid[0], LEAST), np.maximum(grid[1], ROUGHNESS.low)
    across = np.maximum(grid[2], ROUGHNESS.low) if len(grid) > 2 else along
    mixing = np.minimum(grid[3], THIN) if len(grid) > 2 else np.zeros_like(along)
    place = place_of(share, along, across, mixing)
    scale = loss_scale(Seen(*map(jnp.asarray, (along, across, mixing))), jnp.asarray(place.mu))
    return np.maximum(exact_loss(kind, place), 0.0).reshape(shape) / np.asarray(scale).reshape(shape)


def interpolated(table: LossTable, place: Place, *, isotropic: bool) -> np.ndarray:
    """The losses as the tables have them."""
    alpha_x, alpha_y, mu, phi = map(jnp.asarray, np.broadcast_arrays(*place))
    w = jnp.stack([jnp.sqrt(1.0 - mu * mu) * jnp.cos(phi), jnp.sqrt(1.0 - mu * mu) * jnp.sin(phi), mu], axis=-1)
    seen = Seen(alpha_x, None, None) if isotropic else seen_roughness(Axes(alpha_x, alpha_y), w)
    return np.asarray(table_loss(table, seen, mu))


def mean_table(table: LossTable, shape: tuple[int, ...]) -> np.ndarray:
    """log(mean / alpha^2) of the interpolated losses, by roughness and, if the shape has two entries, by ratio."""
    alpha = ROUGHNESS.low ** (1.0 - np.linspace(0.0, 1.0, shape[0]))
    ratios = np.linspace(0.0, 1.0, shape[1]) if len(shape) > 1 else np.ones(1)
    means = [
        [interpolated_mean(table, a, max(a * q, 1e-8), isotropic=len(shape) == 1) / a**2 for q in ratios] for a in alpha
    ]
    return np.log(np.reshape(means, shape))


def interpolated_mean(table: LossTable, alpha_x: float, alpha_y: float, *, isotropic: bool, pieces: int = 24) -> float:
    """By Gauss-Legendre in log(mu), from 1e-4 of the roughness on, and azimuths that are dense about the thin side."""
    ends = np.linspace(np.log(1e-4 * alpha_x), 0.0, pieces + 1)
    points, weights = unit_gauss(8)
    width = ends[1] - ends[0]
    log, mass = (ends[:-1, None] + width * points).ravel(), np.tile(width * weights, pieces)
    turn, share = unit_gauss(1 if isotropic else 24)
    phi = 0.5 * np.pi * (1.0 - turn**2)
    mu = np.exp(log)[:, None]
    lost = interpolated(table, Place(np.array(alpha_x), np.array(alpha_y), mu, phi), isotropic=isotropic)
    return float(np.sum(2.0 * mu * mu * mass[:, None] * (2.0 * share * turn) * lost) / np.sum(2.0 * share * turn))


def make(kind: type) -> LossTable:
    bare = LossTable(share_table(kind, ISOTROPIC), share_table(kind, GENERAL), np.zeros(0), np.zeros(0))
    rounded = bare._replace(general=bare.general.astype(np.float16).astype(float))
    means = mean_table(rounded, (ISOTROPIC_MEAN,)), mean_table(rounded, GENERAL_MEAN)
    return rounded._replace(isotropic_mean=means[0], general_mean=means[1])


def report(name: str, kind: type, table: LossTable, *, count: int = 1000) -> None:
    """Print the largest errors at random places, a third of them near grazing and a third of thin ellipses."""
    rng = np.random.default_rng(0)
    alpha = np.exp(rng.uniform(np.log(ROUGHNESS.low), 0.0, (2, count)))
    alpha[:, ::2] = rng.uniform(ROUGHNESS.low, 1.0, (2, (count + 1) // 2))
    alpha[0, ::3] = 1.0
    mu = np.where(rng.random(count) < 0.6, rng.random(count), 10.0 ** rng.uniform(-4.0, 0.0, count))
    place = Place(*alpha, mu, rng.uniform(0.0, 2.0 * np.pi, count))
    same = place._replace(alpha_x=alpha[1])
    for label, at, isotropic in (
        ("isotropic", same, True),
        ("isotropic as general", same, False),
        ("general", place, False),
    ):
        exact = exact_loss(kind, at)
        finer = exact_loss(kind, at, nodes=(2 * NODES[0], 2 * NODES[1]))
        wrong = np.abs(interpolated(table, at, isotropic=isotropic) - finer)
        worst = ", ".join(f"{float(x[wrong.argmax()]):.3g}" for x in at)
        print(
            f"{name} {label}: quadrature {np.abs(exact - finer).max():.1e}, table {wrong.max():.1e}, rms "
            f"{np.sqrt(np.mean(wrong**2)):.1e}, worst at {worst}"
        )


def main(path: str) -> None:
    arrays = {}
    for kind, name in NAMES.items():
        table = make(kind)
        report(name, kind, table)
        kinds = LossTable(np.float32, np.float16, np.float32, np.float32)
        arrays |= {
            f"{name}_{field}": getattr(table, field).astype(getattr(kinds, field)) for field in LossTable._fields
        }
    np.savez_compressed(path, **arrays)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    main(*(sys.argv[1:] or ["jaxbrdf/brdf/microfacet_loss.npz"]))
