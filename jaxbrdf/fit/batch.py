"""What a training step is shown."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax


class Batch(NamedTuple):
    """Queries as a model encodes them, with the values to be reached; the batch is every array's last axis.

    Attributes:
        coordinates: a model's coordinates, arrays of shape `(batch,)`.
        target: f in 1/sr, `(3, batch)`.
        importance: weight of each query in a mean over cosine-distributed directions, `(batch,)`.
    """

    coordinates: Any
    target: jax.Array
    importance: jax.Array
