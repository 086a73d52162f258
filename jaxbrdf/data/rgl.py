"""Measured BRDFs of the RGL material database (Dupuy and Jakob 2018): `.bsdf` tensor files to arrays."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import NamedTuple

import numpy as np

from jaxbrdf.data import spectrum, tensor_file
from jaxbrdf.errors import DataError


class Rgl(NamedTuple):
    """The arrays of one material, as the file holds them; P azimuths and T elevations of the viewer (our wo).

    Attributes:
        description: the material in words.
        phi_i: azimuths in radians, increasing, `(P,)`.
        theta_i: elevations in radians, increasing, `(T,)`.
        ndf: density of microfacet normals over (phi_m, theta_m), `(H, W)`.
        sigma: projected area of the microfacets over (phi_i, theta_i), `(H, W)`.
        vndf: density of visible normals over (phi_m, theta_m), not normalised, `(P, T, H, W)`.
        luminance: density of light in the square that `vndf` warps to, not normalised, `(P, T, h, w)`.
        rgb: linear Rec.709 reflectance in that square, `(P, T, 3, h, w)`; noise makes some of it negative.
        jacobian: whether `rgb` is to be multiplied by ndf / (4 sigma).
    """

    description: str
    phi_i: np.ndarray
    theta_i: np.ndarray
    ndf: np.ndarray
    sigma: np.ndarray
    vndf: np.ndarray
    luminance: np.ndarray
    rgb: np.ndarray
    jacobian: bool

    @property
    def isotropic(self) -> bool:
        """Whether azimuths count from the viewer's; one or two of `phi_i` say so, as in Mitsuba."""
        return len(self.phi_i) <= 2


def read(content: bytes, path: str | PathLike[str]) -> Rgl:
    """The material in the bytes of a `.bsdf` file, RGB or spectral (see `spectrum.to_rgb` for the latter).

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    fields = tensor_file.read(content, path)
    phi_i = _knots(fields, "phi_i", path)
    theta_i = _knots(fields, "theta_i", path)
    conditions = (len(phi_i), len(theta_i))
    vndf = _density(fields, "vndf", conditions, path)
    luminance = _density(fields, "luminance", conditions, path)
    rgb = _reflectance(fields, (*conditions, -1, *luminance.shape[2:]), path)
    if not np.any(rgb > 0):
        raise DataError(path, "the reflectance is zero everywhere")
    ndf, sigma = _map(fields, "ndf", path), _map(fields, "sigma", path)
    jacobian = bool(_floats(fields, "jacobian", (1,), path, dtype=np.uint8)[0])
    return Rgl(_description(fields), phi_i, theta_i, ndf, sigma, vndf, luminance, rgb, jacobian)


def _floats(fields: Mapping, name: str, shape: tuple[int, ...], path, dtype: type = np.float32) -> np.ndarray:
    """The field `name`, of the wanted type and shape, where -1 stands for any length; all of it finite."""
    if name not in fields:
        raise DataError(path, f"the field '{name}' is missing")
    values = fields[name]
    if values.dtype != dtype:
        raise DataError(path, f"field '{name}' is {values.dtype}, should be {np.dtype(dtype)}")
    fits = len(values.shape) == len(shape) and all(w in (-1, n) for n, w in zip(values.shape, shape, strict=True))
    if not fits or values.size == 0:
        wanted = ", ".join("any" if n == -1 else str(n) for n in shape)
        raise DataError(path, f"field '{name}' has shape {list(values.shape)}, should be [{wanted}]")
    finite = np.isfinite(values)
    if not finite.all():
        where = np.unravel_index(int(np.argmin(finite)), values.shape)
        raise DataError(path, f"field '{name}' is not finite at {[int(i) for i in where]}")
    return values


def _knots(fields: Mapping, name: str, path) -> np.ndarray:
    knots = _floats(fields, name, (-1,), path)
    if np.any(np.diff(knots) <= 0):
        raise DataError(path, f"field '{name}' does not increase")
    return knots


def _map(fields: Mapping, name: str, path) -> np.ndarray:
    values = _floats(fields, name, (-1, -1), path)
    if min(values.shape) < 2:
        raise DataError(path, f"field '{name}' {list(values.shape)} is too small to interpolate")
    if np.any(values < 0) or not np.any(values > 0):
        raise DataError(path, f"field '{name}' is negative somewhere or zero everywhere")
    return values


def _density(fields: Mapping, name: str, conditions: tuple[int, int], path) -> np.ndarray:
    values = _floats(fields, name, (*conditions, -1, -1), path)
    if min(values.shape[2:]) < 2:
        raise DataError(path, f"field '{name}' {list(values.shape)} is too small to interpolate")
    if np.any(values < 0):
        raise DataError(path, f"field '{name}' is a density but has negative values")
    empty = ~np.any(values > 0, axis=(2, 3))
    if empty.any():
        where = [int(i) for i in np.argwhere(empty)[0]]
        raise DataError(path, f"field '{name}' is zero everywhere at (phi_i, theta_i) number {where}")
    return values


def _reflectance(fields: Mapping, shape: tuple[int, ...], path) -> np.ndarray:
    """The field `rgb`, or `spectra` taken to linear Rec.709; the third axis becomes the three channels."""
    if "wavelengths" not in fields:
        return _floats(fields, "rgb", (*shape[:2], 3, *shape[3:]), path)
    wavelengths = _knots(fields, "wavelengths", path)
    spectra = _floats(fields, "spectra", (*shape[:2], len(wavelengths), *shape[3:]), path)
    weights = spectrum.to_rgb(wavelengths, path).astype(np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        rgb = np.moveaxis(np.moveaxis(spectra, 2, -1) @ weights, -1, 2)
    if not np.isfinite(rgb).all():
        raise DataError(path, "field 'spectra' is too large for single precision")
    return rgb


def _description(fields: Mapping) -> str:
    raw = fields.get("description", np.empty(0, np.uint8))
    return raw.tobytes().decode("utf-8", "replace") if raw.dtype == np.uint8 else ""
