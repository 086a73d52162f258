"""Derive the coefficients of `jaxbrdf.core.arctangent`: a minimax polynomial for atan(x) / x in x^2 on [0, 1]."""

from __future__ import annotations

import numpy as np

TERMS = 9
NODES = 20001
ROUNDS = 200


def minimax(terms: int = TERMS) -> tuple[np.ndarray, float]:
    """Coefficients, lowest power first and the first fixed to one, and the largest relative error in exact arithmetic.

    Lawson's iteration: least squares whose weights grow where the error is largest converges to the minimax fit.
    """
    x = 0.5 - 0.5 * np.cos(np.pi * np.linspace(1e-3, 1.0, NODES))
    target = np.arctan(x) / x
    powers = np.stack([x ** (2 * k) for k in range(1, terms)], axis=-1)
    weights = np.ones_like(x)
    best, least = np.zeros(terms - 1), np.inf
    for _ in range(ROUNDS):
        scale = np.sqrt(weights) / target
        solution = np.linalg.lstsq(powers * scale[:, None], (target - 1.0) * scale, rcond=None)[0]
        error = np.abs((1.0 + powers @ solution) / target - 1.0)
        if error.max() < least:
            best, least = solution, error.max()
        weights *= error / error.max() + 1e-12
        weights /= weights.sum()
    return np.concatenate([[1.0], best]), float(least)


def float32_error(coefficients: np.ndarray) -> float:
    """Largest relative error of the polynomial in float32, Horner's rule, against float64."""
    x = np.linspace(1e-6, 1.0, 1_000_001).astype(np.float32)
    square, value = x * x, np.full_like(x, coefficients[-1])
    for c in coefficients[-2::-1]:
        value = value * square + np.float32(c)
    exact = np.arctan(x.astype(np.float64))
    return float(np.max(np.abs(value * x / exact - 1.0)))


if __name__ == "__main__":
    for count in (TERMS - 1, TERMS, TERMS + 1):
        found, exact_error = minimax(count)
        print(count, f"exact {exact_error:.1e}, float32 {float32_error(found):.1e}")
        print([float(np.float32(c)) for c in found])
