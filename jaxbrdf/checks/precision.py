"""What float32 loses: the same rounded queries and parameters, once in each precision."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.compiled import values
from jaxbrdf.types import Brdf, Params, Query

NEGLIGIBLE = 1e-20
"""1/sr; below it a value is as good as zero, and may have underflowed."""


def relative_loss(brdf: Brdf, params: Params, query: Query) -> np.ndarray:
    """|f32 - f64| / (f64 + `NEGLIGIBLE`), the largest of the channels, `(n,)`; infinite where one is not finite."""
    single = np.asarray(values(brdf, params, query), np.float64)
    with jax.enable_x64(True):
        double = values(brdf, *jax.tree.map(_widened, (params, query)))
    loss = np.abs(single - double) / (np.abs(double) + NEGLIGIBLE)
    return np.nan_to_num(loss, nan=np.inf).max(axis=-1)


def _widened(leaf: jax.Array) -> jax.Array:
    values = np.asarray(leaf)
    if not np.issubdtype(values.dtype, np.floating):
        return jnp.asarray(values)
    # compiled code takes subnormal numbers as zero
    flushed = np.where(np.abs(values) < np.finfo(values.dtype).tiny, 0.0, values)
    return jnp.asarray(flushed, jnp.float64)
