"""The pixels of a picture, in chunks that are rendered at a time."""

from __future__ import annotations

import numpy as np

CHUNK = 2**13


def pixels_of_the_sphere(height: int, width: int) -> np.ndarray:
    """Flat indices of the pixels that the sphere can touch, `(chunks, CHUNK)`; the last is repeated to fill a chunk."""
    row, column = np.divmod(np.arange(height * width), width)
    radius = 0.5 * min(height, width)
    near = np.hypot(column + 0.5 - 0.5 * width, row + 0.5 - 0.5 * height) < radius + 1.0
    pixels = np.flatnonzero(near)
    return np.pad(pixels, (0, -len(pixels) % CHUNK), mode="edge").astype(np.int32).reshape(-1, CHUNK)


def all_pixels(height: int, width: int) -> np.ndarray:
    """Flat indices of all pixels in equal chunks of at most `CHUNK`; the last pixel is repeated to fill them."""
    pixels = np.arange(height * width, dtype=np.int32)
    chunks = -(-len(pixels) // CHUNK)
    return np.pad(pixels, (0, -len(pixels) % chunks), mode="edge").reshape(chunks, -1)


def to_image(pixels: np.ndarray, colours: np.ndarray, height: int, width: int) -> np.ndarray:
    """Colours `(n, 3)` at their pixels, `(height, width, 3)` float32, black elsewhere."""
    image = np.zeros((height * width, 3), np.float32)
    # backwards, so that the last pixel keeps its first rendering and not a filler's
    image[pixels.ravel()[::-1]] = colours[::-1]
    return image.reshape(height, width, 3)
