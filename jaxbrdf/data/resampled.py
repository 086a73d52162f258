"""Pictures of another size."""

from __future__ import annotations

import numpy as np
from skimage.transform import resize, resize_local_mean


def resampled(values: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Values `(H, W, C)` at `size` (rows, columns), float32.

    An axis that becomes shorter takes the mean over what each new texel covers, one that becomes longer is
    interpolated linearly between texel centres and constant beyond the outermost.
    """
    least = tuple(np.minimum(values.shape[:2], size).tolist())
    reduced = values if values.shape[:2] == least else resize_local_mean(values, least, channel_axis=-1)
    grown = resize(reduced, (*size, values.shape[2]), order=1, mode="edge", anti_aliasing=False, preserve_range=True)
    return np.asarray(grown, np.float32)
