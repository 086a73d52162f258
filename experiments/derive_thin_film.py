"""Derive the observers' poles of `jaxbrdf.core.thin_film`.

    python experiments/derive_thin_film.py

An optical path difference D turns the phase of light of wavelength l by 2 pi D / l. What a channel sees of it is the
Fourier transform of its response over the wavenumber, s(D) = sum of response(l) exp(2 pi i D / l), which is fitted as
sum_j w_j exp((i beta_j - alpha_j) D) with sum_j w_j = 1. Prints the poles, their largest and root-mean-square error,
and beside them those of as many Gaussians, w_j exp(i beta_j D - (sigma_j D)^2 / 2) with real w_j, after Belcour and
Barla (2017), who sum a few orders of interference one by one. Then the largest error of films' reflectance by either.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from jaxbrdf.data.spectrum import VISIBLE, visible_response

TERMS = 5
STARTS = 24
PATHS = np.arange(0.0, 16001.0, 50.0)
"""Nanometres: two times a film of 2000 nm and index 2, to the second order."""

SCALE = 1e-3
"""1/nm: of decay rates and widths, so that the unknowns are about one."""

STIFFNESS = 1e-4
"""Weight on |w|, against fits that cancel large terms."""


class Fit(NamedTuple):
    """decay: alpha or sigma, 1/nm. turn: beta, 1/nm. weight: w. worst, rms: distance from the transform."""

    decay: np.ndarray
    turn: np.ndarray
    weight: np.ndarray
    worst: float
    rms: float


class Films(NamedTuple):
    """Which films are tried: all combinations."""

    cosines: tuple[float, ...]
    indices: tuple[float, ...]
    bases: tuple[complex, ...]
    thicknesses: np.ndarray


FILMS = Films(
    cosines=(0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0),
    indices=(1.2, 1.33, 1.5, 1.75, 2.0),
    bases=(1.0, 1.5, 2.4, 0.2 + 3.3j, 1.0 + 6.5j, 3.0 + 3.3j),
    thicknesses=np.arange(0.0, 2001.0, 20.0),
)
ORDERS = (2, 3, 8, 64)


def transform() -> np.ndarray:
    """s at `PATHS` for R, G and B, `(D, 3)`, in float64."""
    return np.exp(2j * np.pi * PATHS[:, None] / VISIBLE) @ visible_response()


def poles(paths: np.ndarray, fit: Fit) -> np.ndarray:
    """Terms at `paths`, `(D, 1)`, without their weights."""
    return np.exp(paths * (1j * fit.turn - fit.decay))


def gaussians(paths: np.ndarray, fit: Fit) -> np.ndarray:
    """Terms at `paths`, `(D, 1)`, without their weights."""
    return np.exp(1j * paths * fit.turn - 0.5 * (paths * fit.decay) ** 2)


FAMILIES: dict[str, Callable] = {"Gaussians": gaussians, "poles": poles}


def solve_weights(basis: np.ndarray, wanted: np.ndarray, *, real: bool) -> tuple[np.ndarray, np.ndarray]:
    """Least squares for weights that sum to one, and the residuals."""
    free, known = basis[:, 1:] - basis[:, :1], wanted - basis[:, 0]
    if real:
        free, known = np.concatenate([free.real, free.imag]), np.concatenate([known.real, known.imag])
    stiff = np.concatenate([free, STIFFNESS * np.sqrt(len(PATHS)) * np.eye(free.shape[1])])
    found = np.linalg.lstsq(stiff, np.concatenate([known, np.zeros(free.shape[1])]), rcond=None)[0]
    weight = np.concatenate([[1.0 - found.sum()], found])
    return weight, basis @ weight - wanted


def fit(wanted: np.ndarray, family: Callable, rng: np.random.Generator) -> Fit:
    """The best of several starts; the weights are linear, and solved for inside."""
    bounds = np.repeat([[np.log(0.02), 0.85], [np.log(3.0), 1.75]], TERMS, axis=-1).reshape(2, -1)
    starts = [np.concatenate([rng.uniform(-1.5, 0.5, TERMS), rng.uniform(0.95, 1.6, TERMS)]) for _ in range(STARTS)]

    def at(x: np.ndarray) -> tuple[Fit, np.ndarray]:
        """The fit with these unknowns and the best weights, and what it leaves."""
        bare = Fit(SCALE * np.exp(x[:TERMS]), 10.0 * SCALE * x[TERMS:], np.zeros(TERMS), np.inf, np.inf)
        weight, left = solve_weights(family(PATHS[:, None], bare), wanted, real=family is gaussians)
        size = np.abs(left)
        return bare._replace(weight=weight, worst=float(size.max()), rms=float(np.sqrt(np.mean(size**2)))), left

    def residuals(x: np.ndarray) -> np.ndarray:
        found, left = at(x)
        return np.concatenate([left.real, left.imag, STIFFNESS * np.sqrt(len(PATHS)) * np.abs(found.weight)])

    found = min((least_squares(residuals, x, bounds=bounds) for x in starts), key=lambda result: result.cost)
    best = at(found.x)[0]
    order = np.argsort(best.turn)
    return best._replace(decay=best.decay[order], turn=best.turn[order], weight=best.weight[order])


def film_error(fits: list[Fit], family: Callable, orders: int, base: complex) -> float:
    """Largest error of R, G and B over `FILMS`, without a film's dispersion, the transform at m D by `fits`."""
    worst = 0.0
    for cos in FILMS.cosines:
        for eta in FILMS.indices:
            along = np.sqrt(eta**2 - 1.0 + cos**2)
            paths = 2.0 * along * FILMS.thicknesses
            exact = taken(paths[:, None] * 2.0 * np.pi / VISIBLE, cos, eta, base) @ visible_response()
            worst = max(worst, float(np.abs(series(fits, family, orders, paths, cos, eta, base) - exact).max()))
    return worst


def interfaces(cos: float, eta: float, base: complex) -> list[tuple[float, complex]]:
    """r12 and r23 of both polarisations."""
    index = np.array([1.0, eta, base])
    along = np.sqrt(index**2 - 1.0 + cos**2 + 0j)
    kinds = (along, along / index**2)
    return [(((y[0] - y[1]) / (y[0] + y[1])).real, (y[1] - y[2]) / (y[1] + y[2])) for y in kinds]


def taken(phase: np.ndarray, cos: float, eta: float, base: complex) -> np.ndarray:
    """1 - R from Airy's amplitude, (r12 + r23 e) / (1 + r12 r23 e)."""
    turn = np.exp(1j * phase)
    squares = (np.abs((a + b * turn) / (1.0 + a * b * turn)) ** 2 for a, b in interfaces(cos, eta, base))
    return 1.0 - 0.5 * sum(squares)


def series(
    fits: list[Fit], family: Callable, orders: int, paths: np.ndarray, cos: float, eta: float, base: complex
) -> np.ndarray:
    """1 - R for R, G and B with so many orders of interference, `(paths, 3)`."""
    total = np.zeros((len(paths), len(fits)))
    for a, b in interfaces(cos, eta, base):
        scale = (1.0 - a * a) * (1.0 - abs(b) ** 2) / (1.0 - abs(a * b) ** 2)
        for m in range(1, orders + 1):
            seen = np.stack([family(m * paths[:, None], fit) @ fit.weight for fit in fits], axis=-1)
            total += scale * ((-a * b) ** m * seen).real
        total += 0.5 * scale
    return total


def main() -> None:
    rng = np.random.default_rng(0)
    found = {kind: [fit(s, family, rng) for s in transform().T] for kind, family in FAMILIES.items()}
    for kind, fits in found.items():
        for name, one in zip("RGB", fits, strict=True):
            print(f"{name}: {TERMS} {kind}: worst {one.worst:.1e}, rms {one.rms:.1e}")
            for row in zip(one.decay, one.turn, one.weight.real, one.weight.imag, strict=True):
                print("    (" + ", ".join(f"{number:.9g}" for number in row) + "),")
        for orders in ORDERS:
            errors = (film_error(fits, FAMILIES[kind], orders, base) for base in FILMS.bases)
            print(f"films, {kind}, {orders} orders:", ", ".join(f"{error:.4f}" for error in errors))


if __name__ == "__main__":
    main()
