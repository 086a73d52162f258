"""Spatial lookups in float64, one place and one texel at a time: the reference of the fast ones, in OpenCL too."""

from __future__ import annotations

import math

import numpy as np

from jaxbrdf.texture.pyramid import Layout


def footprints(count: int, most: float) -> np.ndarray:
    """From a thousandth of a period to `most`, round to a thousand times as long as wide, `(count, 2, 2)` float32."""
    rng = np.random.default_rng(3)
    (c, d), (s, t) = (f(rng.uniform(0, 2 * np.pi, (2, count))) for f in (np.cos, np.sin))
    long, ratio = 10 ** rng.uniform(-3, np.log10(most), count), 10 ** -rng.uniform(0, 3, count)
    # a rotation, times long diag(1, ratio), times another
    rows = [c * d - ratio * s * t, -c * t - ratio * s * d, s * d + ratio * c * t, -s * t + ratio * c * d]
    return (long * rows).T.reshape(count, 2, 2).astype(np.float32)


def levels(layout: Layout, texels: np.ndarray) -> list[np.ndarray]:
    """Every level as an image, cut from the table one after the other."""
    images, rows, columns = [], layout.height, layout.width
    table = np.asarray(texels, np.float64)
    while len(table):
        images.append(table[: rows * columns].reshape(rows, columns, -1))
        table = table[rows * columns :]
        rows, columns = max(rows // 2, 1), max(columns // 2, 1)
    return images


def bilinear(layout: Layout, image: np.ndarray, u: float, v: float) -> np.ndarray:
    """Four texels of one image, whose numbers are wrapped as whole numbers, however far they are."""
    rows, columns = image.shape[:2]
    if not (math.isfinite(u) and math.isfinite(v)):
        return np.full(image.shape[2], math.nan)
    i, j = math.floor(v * rows - 0.5), math.floor(u * columns - 0.5)
    y, x = v * rows - 0.5 - i, u * columns - 0.5 - j
    total = np.zeros(image.shape[2])
    for row, of_row in ((i, 1 - y), (i + 1, y)):
        for column, of_column in ((j, 1 - x), (j + 1, x)):
            total += of_row * of_column * image[wrapped(layout, row, rows), wrapped(layout, column, columns)]
    return total


def wrapped(layout: Layout, n: int, count: int) -> int:
    """The texel that stands for number n of an endless row."""
    if layout.wrap == "repeat":
        return n % count
    if layout.wrap == "clamp":
        return min(max(n, 0), count - 1)
    return min(n % (2 * count), 2 * count - 1 - n % (2 * count))


def trilinear(layout: Layout, images: list[np.ndarray], u: float, v: float, lod: float) -> np.ndarray:
    """Two whole lookups."""
    lod = min(max(lod, 0.0), len(images) - 1.0)
    low = min(math.floor(lod), len(images) - 1)
    high = min(low + 1, len(images) - 1)
    return (1 - lod + low) * bilinear(layout, images[low], u, v) + (lod - low) * bilinear(layout, images[high], u, v)


def lod_of(scale: float) -> float:
    """The level whose blend with the next has the variance scale^2 / 4, by walking up."""
    level = 0
    while 4.0 ** (level + 1) <= scale**2:
        level += 1
    return level + max((scale**2 - 4.0**level) / (3 * 4.0**level), 0.0)


def anisotropic(
    layout: Layout, images: list[np.ndarray], uv: np.ndarray, footprint: np.ndarray, probes: int
) -> np.ndarray:
    """Singular values by LAPACK, then one whole trilinear lookup a probe."""
    if np.isnan(footprint).any():
        return np.full(images[0].shape[2], math.nan)
    finite = np.clip(np.asarray(footprint, np.float64), -1e9, 1e9)
    axes, (major, minor), _ = np.linalg.svd(np.diag([layout.width, layout.height]) @ finite)
    minor = max(minor, major / probes, 1.0)
    excess = max(major**2 - minor**2, 0.0)
    count = min(math.ceil(math.sqrt(1 + 3 * excess / minor**2) - 1e-9), probes)
    step = math.sqrt(3 * excess / (count**2 - 1)) if count > 1 else 0.0
    places = [uv + (k - (count - 1) / 2) * step * axes[:, 0] / [layout.width, layout.height] for k in range(count)]
    return np.mean([trilinear(layout, images, u, v, lod_of(minor)) for u, v in places], axis=0)
