"""Derive the minimax polynomials of `jaxbrdf.core.arctangent` and of kernels_cl/include/numerics.cl.

    python experiments/derive_polynomials.py

Prints, for each function and some numbers of terms, the coefficients as rounded to float32 and the largest error: of
exact arithmetic, and of Horner's rule in float32.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

NODES = 20001
ROUNDS = 200


class Target(NamedTuple):
    """A function to approximate as a polynomial whose first coefficients are given.

    Attributes:
        name: of the quantity.
        of: what the polynomial is to be, in float64.
        low, high: the interval.
        step: 2 for a polynomial in x^2.
        fixed: the first coefficients, which make it exact at zero.
        terms: how many coefficients in all are in use.
    """

    name: str
    of: Callable[[np.ndarray], np.ndarray]
    low: float
    high: float
    step: int
    fixed: tuple[float, ...]
    terms: int


TARGETS = (
    Target("atan(x) / x", lambda x: np.arctan(x) / x, 0.0, 1.0, 2, (1.0,), 9),
    Target("exp2(x)", np.exp2, -0.5, 0.5, 1, (1.0,), 6),
    Target("log2(1 + x) / x", lambda x: np.log2(1 + x) / x, np.sqrt(0.5) - 1, np.sqrt(2.0) - 1, 1, (), 9),
    Target("sin(2 pi x) / x", lambda x: np.sin(2 * np.pi * x) / x, 0.0, 0.125, 2, (), 4),
    Target("cos(2 pi x)", lambda x: np.cos(2 * np.pi * x), 0.0, 0.125, 2, (1.0,), 4),
)


def nodes(target: Target) -> np.ndarray:
    """Places denser towards the ends, none at zero, where a ratio is 0 / 0."""
    x = target.low + (target.high - target.low) * (0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, NODES)))
    return x[np.abs(x) > 1e-6]


def minimax(target: Target, terms: int) -> tuple[np.ndarray, float]:
    """Coefficients, lowest power first, and the largest relative error in exact arithmetic.

    Lawson's iteration: least squares whose weights grow where the error is largest converges to the minimax fit.
    """
    x = nodes(target)
    wanted = target.of(x)
    powers = np.stack([x ** (target.step * k) for k in range(terms)], axis=-1)
    fixed = np.asarray(target.fixed)
    known, free = powers[:, : fixed.size] @ fixed, powers[:, fixed.size :]
    weights = np.ones_like(x)
    best, least = np.zeros(free.shape[1]), np.inf
    for _ in range(ROUNDS):
        scale = np.sqrt(weights) / np.abs(wanted)
        solution = np.linalg.lstsq(free * scale[:, None], (wanted - known) * scale, rcond=None)[0]
        error = np.abs((known + free @ solution) / wanted - 1.0)
        if error.max() < least:
            best, least = solution, error.max()
        weights *= error / error.max() + 1e-12
        weights /= weights.sum()
    return np.concatenate([fixed, best]), float(least)


def float32_error(target: Target, coefficients: np.ndarray) -> float:
    """Largest relative error of the polynomial in float32, Horner's rule, against float64."""
    x = nodes(target).astype(np.float32)
    argument = x * x if target.step == 2 else x
    value = np.full_like(x, coefficients[-1])
    for c in coefficients[-2::-1]:
        value = value * argument + np.float32(c)
    return float(np.max(np.abs(value / target.of(x.astype(np.float64)) - 1.0)))


def main() -> None:
    for target in TARGETS:
        for terms in range(target.terms - 1, target.terms + 2):
            found, exact_error = minimax(target, terms)
            used = " (in use)" if terms == target.terms else ""
            errors = f"exact {exact_error:.1e}, float32 {float32_error(target, found):.1e}"
            print(f"{target.name}, {terms} terms{used}: {errors}")
            print("   ", [float(np.float32(c)) for c in found])


if __name__ == "__main__":
    main()
