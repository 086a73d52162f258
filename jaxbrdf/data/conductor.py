"""The colour of a metal from its refractive index over wavelengths, and an index a channel that gives it back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from jaxbrdf.data.ior import RefractiveIndex, interpolate
from jaxbrdf.data.spectrum import VISIBLE, visible_response

NODES = 32
"""Cosines of the fit, those of Gauss and Legendre in [0, 1]: every share of the facet's projected half circle alike."""

TRIALS = 400
"""Candidates for eta that bracket the least error."""

DULLEST, BRIGHTEST = 1e-3, 0.999
"""Reflectances at normal incidence that an index is made for: what a colour outside the gamut is taken to."""

PULL = 1e-6
"""Of squared reflectance per squared index, towards the channel's mean index: decides where all indices reflect alike,
as near R = 1, so that the phase stays the metal's; elsewhere it moves reflectance by less than 1e-4."""


class ChannelIndex(NamedTuple):
    """An index for each of R, G and B.

    Attributes:
        eta, k: real and imaginary part, `(3,)`.
        rms, worst: distance of its reflectance from the spectral one clipped to [0, 1], over even cosines, `(3,)`.
    """

    eta: np.ndarray
    k: np.ndarray
    rms: np.ndarray
    worst: np.ndarray


def rgb_reflectance(index: RefractiveIndex, cos: np.ndarray) -> np.ndarray:
    """Linear Rec.709 reflectance `(..., 3)` under D65 at the cosines `(...)`, each wavelength on its own, float64.

    The index is linear between its samples. Not clipped: a saturated colour may leave the gamut.
    """
    return _reflectance(np.asarray(cos)[..., None], interpolate(index, VISIBLE)) @ visible_response()


def channel_index(index: RefractiveIndex) -> ChannelIndex:
    """eta and k for R, G and B with the spectral reflectance at normal incidence, and the closest to it elsewhere.

    Closest in least squares over even cosines. Of all indices with the reflectance R at normal incidence, eta is free
    between (1 - r) / (1 + r) and (1 + r) / (1 - r), r = sqrt(R), and k^2 = (R (eta + 1)^2 - (eta - 1)^2) / (1 - R)
    (Gulbrandsen 2014). A channel outside the gamut, as gold's red is, is fitted at the nearest value.
    """
    cos = 0.5 * (np.polynomial.legendre.leggauss(NODES)[0] + 1.0)
    weights = 0.5 * np.polynomial.legendre.leggauss(NODES)[1]
    normal = np.clip(rgb_reflectance(index, np.ones(())), DULLEST, BRIGHTEST)
    wanted = np.clip(rgb_reflectance(index, cos), 0.0, 1.0)
    means = interpolate(index, VISIBLE) @ visible_response()
    found = np.array([_best(*channel, cos, weights) for channel in zip(normal, means, wanted.T, strict=True)])
    apart = _reflectance(cos[:, None], found) - wanted
    return ChannelIndex(np.real(found), np.imag(found), np.sqrt(weights @ apart**2), np.max(np.abs(apart), axis=0))


def _best(normal: float, mean: complex, wanted: np.ndarray, cos: np.ndarray, weights: np.ndarray) -> complex:
    """The index of one channel, by the logarithm of eta: bracketed by trials first, as there can be two minima."""
    end = np.log((1.0 + np.sqrt(normal)) / (1.0 - np.sqrt(normal)))

    def index(log_eta: float) -> complex:
        eta = np.exp(log_eta)
        squared = (normal * (eta + 1.0) ** 2 - (eta - 1.0) ** 2) / (1.0 - normal)
        return complex(eta, np.sqrt(max(squared, 0.0)))

    def error(log_eta: float) -> float:
        apart = _reflectance(cos, index(log_eta)) - wanted
        return float(weights @ apart**2) + PULL * abs(index(log_eta) - mean) ** 2

    trials = np.linspace(-end, end, TRIALS)
    least = int(np.argmin([error(trial) for trial in trials]))
    bracket = trials[max(least - 1, 0)], trials[min(least + 1, TRIALS - 1)]
    return index(minimize_scalar(error, bounds=bracket, method="bounded", options={"xatol": 1e-10}).x)


def _reflectance(cos: np.ndarray, index: complex | np.ndarray) -> np.ndarray:
    """Fresnel's equations in complex float64, unpolarised (Born and Wolf, Principles of Optics, 14.2)."""
    square = np.square(index)
    inside = np.sqrt(square - (1.0 - cos) * (1.0 + cos) + 0j)
    across = (cos - inside) / (cos + inside)
    along = (square * cos - inside) / (square * cos + inside)
    return 0.5 * (np.abs(across) ** 2 + np.abs(along) ** 2)
