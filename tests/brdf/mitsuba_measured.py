"""Mitsuba's `measured` plugin, one query at a time, in this project's roles: its si.wi is our wo."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np


class Reference(NamedTuple):
    """f cos(wi) `(n, channels)`, the density `(n,)`, and for the same random numbers the drawn wi and its weight."""

    value: np.ndarray
    density: np.ndarray
    drawn: np.ndarray
    weight: np.ndarray


def measured(mi, path: Path, wi: np.ndarray, wo: np.ndarray, u: np.ndarray, wavelengths=None) -> Reference:
    """The plugin's answers for pairs `(n, 3)` and uniform numbers `(n, 3)`."""
    plugin, context, rows = mi.load_dict({"type": "measured", "filename": str(path)}), mi.BSDFContext(), []
    for light, viewer, uniform in zip(wi, wo, u, strict=True):
        surface = mi.SurfaceInteraction3f()
        surface.wi = mi.Vector3f(viewer.tolist())
        if wavelengths is not None:
            surface.wavelengths = wavelengths
        towards = mi.Vector3f(light.tolist())
        sample, weight = plugin.sample(context, surface, float(uniform[0]), mi.Point2f(uniform[1:].tolist()))
        value, density = plugin.eval(context, surface, towards), plugin.pdf(context, surface, towards)
        rows.append((np.array(value), density, np.array(sample.wo), np.array(weight)))
    return Reference(*(np.array(column) for column in zip(*rows, strict=True)))


def cosine_directions(rng: np.random.Generator, count: int) -> np.ndarray:
    """Cosine-distributed unit vectors, float32, `(count, 3)`."""
    square, turn = rng.random(count), 2.0 * np.pi * rng.random(count)
    radius = np.sqrt(square)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), np.sqrt(1.0 - square)], axis=-1).astype(np.float32)
