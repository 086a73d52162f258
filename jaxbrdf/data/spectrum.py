"""From sampled reflectance spectra to linear Rec.709."""

from __future__ import annotations

from os import PathLike

import colour
import numpy as np

from jaxbrdf.errors import DataError

OBSERVER = "CIE 1931 2 Degree Standard Observer"
ILLUMINANT = "D65"
"""The white of Rec.709: under it a perfect reflector is white."""

VISIBLE = np.arange(360.0, 781.0)
"""Nanometres: where both the observer's and the illuminant's tables are given, at their finest spacing."""


def to_rgb(wavelengths: np.ndarray, path: str | PathLike[str]) -> np.ndarray:
    """Weights `(N, 3)` that take reflectances at `wavelengths` (nanometres, increasing, `(N,)`) to linear Rec.709.

    The reflectance is taken as linear between its samples and constant outside them, lit by D65, seen by the CIE 1931
    2-degree observer and normalised so that a flat spectrum of 1 is exactly (1, 1, 1): weights[:, c] sums to one.
    Saturated spectra can leave the gamut: a channel may come out negative, and is clamped at evaluation.

    Raises:
        DataError: if no sample lies in the visible range.
    """
    if not np.any((wavelengths >= VISIBLE[0]) & (wavelengths <= VISIBLE[-1])):
        raise DataError(path, f"no wavelength lies between {VISIBLE[0]:.0f} and {VISIBLE[-1]:.0f} nm")
    response = visible_response()
    place = np.interp(VISIBLE, wavelengths, np.arange(len(wavelengths), dtype=np.float64))
    below = np.floor(place).astype(int)
    above = np.minimum(below + 1, len(wavelengths) - 1)
    share = (place - below)[:, None]
    weights = np.zeros((len(wavelengths), 3))
    np.add.at(weights, below, (1.0 - share) * response)
    np.add.at(weights, above, share * response)
    return weights / weights.sum(axis=0)


def visible_response() -> np.ndarray:
    """Weights `(421, 3)` that take reflectances at `VISIBLE` to linear Rec.709; each column sums to one."""
    shape = colour.SpectralShape(VISIBLE[0], VISIBLE[-1], 1.0)
    observer = colour.MSDS_CMFS[OBSERVER].copy().align(shape)
    light = colour.SDS_ILLUMINANTS[ILLUMINANT].copy().align(shape)
    to_rec709 = colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB
    response = (light.values[:, None] * observer.values) @ to_rec709.T
    return response / response.sum(axis=0)
