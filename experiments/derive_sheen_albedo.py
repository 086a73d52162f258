"""Derive the polynomial for the albedo of `jaxbrdf.brdf.sheen`, and the least roughness that keeps energy.

    python experiments/derive_sheen_albedo.py

Prints the largest albedo by roughness, the coefficients, and their largest error at views and roughnesses between those
of the fit. The albedo times cos + area(cos) is smooth in sqrt(cos) and log r, and its logarithm is what is fitted.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.sheen import LEAST_ROUGHNESS, SheenParams, _area, _eval
from jaxbrdf.types import Query

ROUGHNESS = (0.01, 0.03, 0.0625, 0.065, 0.0675, 0.07, 0.1, 0.2, 0.5, 1.0)
"""Whose largest albedo is printed; below the range too, for which the function without its clamp is called."""

NODES = 300
DEGREES = (6, 3)
"""In 2 sqrt(cos) - 1 and in 2 log r / log(least) - 1."""


@jax.jit
def albedo(cos: jax.Array, r: jax.Array) -> jax.Array:
    """Of views `(n,)` and roughnesses `(m,)`, `(n, m)`, by Gauss and Legendre in cos_i^(1/3) and azimuth."""
    t, weights = (jnp.asarray(v) for v in np.polynomial.legendre.leggauss(NODES))
    t, weights = 0.5 * (t + 1.0), 0.5 * weights
    wi = directions(t[:, None] ** 3, jnp.pi * t[None, :])
    mass = 2.0 * jnp.pi * (weights * 3.0 * t**5)[:, None] * weights[None, :]

    def one(cos: jax.Array, r: jax.Array) -> jax.Array:
        wo = jnp.broadcast_to(directions(cos, jnp.zeros_like(cos)), wi.shape)
        return jnp.sum(_eval(SheenParams(jnp.ones(3), r), Query(wi, wo))[..., 0] * mass)

    return jax.lax.map(lambda c: jax.lax.map(lambda s: one(c, s), r), cos)


def directions(cos: jax.Array, phi: jax.Array) -> jax.Array:
    sin = jnp.sqrt((1.0 - cos) * (1.0 + cos))
    return jnp.stack(jnp.broadcast_arrays(sin * jnp.cos(phi), sin * jnp.sin(phi), cos), axis=-1)


def powers(cos: np.ndarray, r: np.ndarray) -> np.ndarray:
    """`(n, m, rows, columns)`."""
    x = 2.0 * np.sqrt(cos) - 1.0
    y = 2.0 * np.log(r) / np.log(LEAST_ROUGHNESS) - 1.0
    columns, rows = x[:, None] ** np.arange(DEGREES[0] + 1), y[:, None] ** np.arange(DEGREES[1] + 1)
    return rows[None, :, :, None] * columns[:, None, None, :]


def area(cos: np.ndarray, r: np.ndarray) -> np.ndarray:
    return np.asarray(_area(*map(jnp.asarray, np.broadcast_arrays(cos[:, None], r[None, :]))))


def fit(cos: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Coefficients, least squares of the albedo's own error: that of its logarithm weighed by the albedo."""
    truth = np.asarray(albedo(cos, r))
    basis = powers(cos, r) * truth[..., None, None]
    wanted = np.log(truth * (cos[:, None] + area(cos, r))) * truth
    solution = np.linalg.lstsq(basis.reshape(truth.size, -1), wanted.ravel(), rcond=None)[0]
    return solution.reshape(basis.shape[2:])


def main() -> None:
    jax.config.update("jax_enable_x64", True)
    for r, most in zip(ROUGHNESS, albedo(np.geomspace(1e-6, 1.0, 60), np.array(ROUGHNESS)).max(0), strict=True):
        print(f"roughness {r}: largest albedo {most:.4f}")
    cos = np.maximum(np.sin(np.linspace(0.0, 0.5 * np.pi, 24)) ** 3, 1e-7)
    coefficients = fit(cos, np.geomspace(LEAST_ROUGHNESS, 1.0, 16))
    between, r = np.geomspace(1e-6, 1.0, 41), np.geomspace(LEAST_ROUGHNESS, 1.0, 23)
    found = np.exp(np.einsum("nmij,ij->nm", powers(between, r), coefficients)) / (between[:, None] + area(between, r))
    print(f"largest error {np.abs(found - albedo(between, r)).max():.1e}")
    for row in coefficients:
        print("   ", tuple(round(float(c), 5) for c in row))


if __name__ == "__main__":
    main()
