"""Where a BRDF is off: its residuals over the angles of half and difference vector."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.colour import luminance
from jaxbrdf.core.directions import above_horizon, half_difference, sin_theta
from jaxbrdf.metrics.brdf_space import SMAPE_OFFSET, Evaluate, TruePairs
from jaxbrdf.types import Query

CELLS = 45


class ResidualMap(NamedTuple):
    """The residual ln((p + `SMAPE_OFFSET`) / (f + `SMAPE_OFFSET`)) of luminances in cells of theta_h and theta_d.

    Attributes:
        theta_h: the cells' edges, degrees, `(n + 1,)`; even in the square root, for highlights are narrow.
        theta_d: the same, even, `(m + 1,)`.
        count: pairs in each cell, `(n, m)`.
        mean: of the residuals there, NaN where there is no pair: where the fit is too bright or too dark.
        root_mean_square: of the residuals there: what colours and azimuths have besides.
    """

    theta_h: np.ndarray
    theta_d: np.ndarray
    count: np.ndarray
    mean: np.ndarray
    root_mean_square: np.ndarray


def residual_map(drawn: Iterable[TruePairs], predicted: Evaluate, *, cells: int = CELLS) -> ResidualMap:
    """The map of a prediction over pairs that were drawn before, each counted alike.

    Args:
        drawn: as `brdf_space.true_pairs` gives them.
        predicted: `query -> f`, compiled.
        cells: along either angle.
    """
    edges = 90.0 * np.linspace(0.0, 1.0, cells + 1) ** 2, np.linspace(0.0, 90.0, cells + 1)
    sums = np.zeros((3, cells, cells))
    for query, _, f in drawn:
        theta_h, theta_d, residual = (np.asarray(x, np.float64) for x in _residuals(query, predicted(query), f))
        for total, weight in zip(sums, (np.isfinite(residual), residual, residual**2), strict=True):
            total += np.histogram2d(theta_h, theta_d, edges, weights=np.nan_to_num(weight))[0]
    count, total, squares = sums
    with np.errstate(invalid="ignore"):
        return ResidualMap(*edges, count, total / count, np.sqrt(squares / count))


@jax.jit
def _residuals(query: Query, predicted: jax.Array, truth: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """theta_h and theta_d in degrees and the residual, NaN below the horizon; each `(n,)`."""
    wh, wd = half_difference(query.wi, query.wo)
    theta_h, theta_d = (jnp.degrees(jnp.arctan2(sin_theta(w), w[..., 2])) for w in (wh, wd))
    residual = jnp.log((luminance(predicted) + SMAPE_OFFSET) / (luminance(truth) + SMAPE_OFFSET))
    return theta_h, theta_d, jnp.where(above_horizon(query.wi, query.wo), residual, jnp.nan)
