"""Batches for the tests of losses and loop."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from jaxbrdf.fit.batch import Batch


def batch_of(target: np.ndarray, importance: np.ndarray | None = None, coordinates: np.ndarray | None = None) -> Batch:
    """A batch of targets `(3, n)`; importance one and no coordinates unless given."""
    count = target.shape[-1]
    weights = np.ones(count) if importance is None else importance
    places = np.zeros(count) if coordinates is None else coordinates
    return Batch(*(jnp.asarray(array, jnp.float32) for array in (places, target, weights)))
