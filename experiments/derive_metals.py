"""Derive the refractive indices of `jaxbrdf.brdf.metals` from the tables in $JAXBRDF_DATA/ior.

    JAXBRDF_DATA=... python experiments/derive_metals.py

Prints the rows of the module, each followed by what its colour is at normal incidence, how far its reflectance is from
the spectral one, clipped to [0, 1], over the angles, and how far one at three single wavelengths would be.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from jaxbrdf.brdf.metals import INDICES, Metal
from jaxbrdf.data import input, ior
from jaxbrdf.data.conductor import channel_index, rgb_reflectance

DIGITS = 4
SINGLE = np.array([611.0, 549.0, 464.0])
"""Nanometres: the dominant wavelengths of the Rec.709 primaries."""

COSINES = np.linspace(0.0, 1.0, 101)


def derive(metal: Metal, folder: Path) -> Metal:
    """The metal with the numbers that its table gives, rounded as they are printed."""
    found = channel_index(read(metal, folder))
    eta, k = (tuple(float(f"{x:.{DIGITS}g}") for x in part) for part in (found.eta, found.k))
    return metal._replace(eta=eta, k=k)


def read(metal: Metal, folder: Path) -> ior.RefractiveIndex:
    path = folder / "ior" / metal.file
    return ior.read(input.read(path), path)


def reflectance(eta: np.ndarray, k: np.ndarray) -> np.ndarray:
    """Of single indices at `COSINES`, `(101, 3)`."""
    ends = np.array([360.0, 780.0])
    flat = [ior.RefractiveIndex(ends, np.full(2, n), np.full(2, m)) for n, m in zip(eta, k, strict=True)]
    return np.stack([rgb_reflectance(index, COSINES)[:, 0] for index in flat], axis=-1)


def main() -> None:
    folder = Path(os.environ["JAXBRDF_DATA"])
    for name, metal in INDICES.items():
        index, derived = read(metal, folder), derive(metal, folder)
        wanted, single = rgb_reflectance(index, COSINES), ior.interpolate(index, SINGLE)
        clipped = np.clip(wanted, 0.0, 1.0)
        apart = np.abs(reflectance(np.array(derived.eta), np.array(derived.k)) - clipped)
        crude = np.abs(reflectance(single.real, single.imag) - clipped)
        print(f'"{name}": Metal({derived.eta}, {derived.k}, "{metal.file}", "{metal.source}"),')
        colour = ", ".join(f"{x:.3f}" for x in wanted[-1])
        print(f"    # normal {colour}; off by {apart.max():.4f}, at single wavelengths {crude.max():.4f}")


if __name__ == "__main__":
    main()
