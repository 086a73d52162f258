"""What float32 loses: the same rounded queries and parameters, once in each precision."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.compiled import values
from jaxbrdf.types import Brdf, Model, Params, Query

COORDINATE_STEP = 2.0**-23
"""Two roundings of a coordinate: of the direction it is made of, and its own."""

NEGLIGIBLE = 1e-20
"""1/sr; below it a value is as good as zero, and may have underflowed."""


def relative_loss(brdf: Brdf, params: Params, query: Query) -> np.ndarray:
    """|f32 - f64| / (f64 + `NEGLIGIBLE`), the largest of the channels, `(n,)`; infinite where one is not finite."""
    single = np.asarray(values(brdf, params, query), np.float64)
    with jax.enable_x64(True):
        double = values(brdf, *jax.tree.map(_widened, (params, query)))
    loss = np.abs(single - double) / (np.abs(double) + NEGLIGIBLE)
    return np.nan_to_num(loss, nan=np.inf).max(axis=-1)


def coordinate_slack(model: Model, params: Params, query: Query) -> np.ndarray:
    """What float32 cannot tell of a learned model: relative change of f, `(n,)`, when coordinates move by 2^-23.

    A model that is steep in its coordinates, such as one whose texture changes within the last texel before the rim,
    takes the rounding of a radius near one times its slope. In float64; the larger of both ways.
    """
    with jax.enable_x64(True):
        wide, at = (jax.tree.map(_widened, tree) for tree in (params, query))
        return np.asarray(jax.jit(partial(_moved, model))(wide, at))


def _moved(model: Model, params: Params, query: Query) -> jax.Array:
    coordinates = model.encode(query)
    log_f = model.decode(params, coordinates)
    ways = [jax.tree.map(lambda x, by=by: x * (1.0 + by), coordinates) for by in (COORDINATE_STEP, -COORDINATE_STEP)]
    return jnp.max(jnp.stack([jnp.abs(model.decode(params, way) - log_f) for way in ways]), axis=(0, 1))


def _widened(leaf: jax.Array) -> jax.Array:
    values = np.asarray(leaf)
    if not np.issubdtype(values.dtype, np.floating):
        return jnp.asarray(values)
    # compiled code takes subnormal numbers as zero
    flushed = np.where(np.abs(values) < np.finfo(values.dtype).tiny, 0.0, values)
    return jnp.asarray(flushed, jnp.float64)
