"""The light that single scattering off microfacets loses, from tables.

With E(w) the directional albedo of `MICROFACET` at a reflectance of one, 1 - E(w) is lost, and its cosine-weighted mean
over w is 2 times the integral of (1 - E) cos over the cosine and the mean over azimuths.

A view turns a roughness A into three numbers: `along` = |A d| and `across` = |A d'|, for w's azimuth d and d' square to
it, and `mixing`, the squared cosine between A d and A d'. The tables hold (1 - E) over

    mu / (mu + along) (along^2 + across^2 mu^2) / (along^2 + across^2 mu^2 + mu^2),

which has the loss's size at grazing and at small roughness, on regular grids of sqrt(mu (1 + along) / (mu + along)),
along, across and mixing, to be interpolated linearly; for isotropic roughness the last two are left out and the grid is
finer.
The tables of means hold log(mean / alpha^2) of exactly these interpolated losses, by the logarithm of the larger alpha
and the share that the smaller one is of it. All are made by experiments/derive_microfacet_albedo.py, which measures an
error of 1 - E of at most 6e-4 for isotropic roughness and 5e-3 for any other (Beckmann; 2.1e-3 for GGX).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache, reduce
from importlib.resources import files
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.numerics import match_rank, safe_divide, safe_norm
from jaxbrdf.core.roughness import ROUGHNESS, Isotropic, Roughness, principal_axes
from jaxbrdf.core.smith import Distribution

FILE = "microfacet_loss.npz"
NAMES: Mapping[type, str] = {Ggx: "ggx", Beckmann: "beckmann"}


class LossTable(NamedTuple):
    """Of one distribution.

    Attributes:
        isotropic: by angle and roughness.
        general: by angle, roughness along and across the view, and mixing.
        isotropic_mean: by roughness.
        general_mean: by larger roughness and ratio.
    """

    isotropic: np.ndarray
    general: np.ndarray
    isotropic_mean: np.ndarray
    general_mean: np.ndarray


class Seen(NamedTuple):
    """A roughness as a view sees it; across and mixing are None where it is the same in every direction."""

    along: jax.Array
    across: jax.Array | None
    mixing: jax.Array | None


def loss(distribution: Distribution, w: jax.Array) -> jax.Array:
    """1 - E(w), `(...)`, for w above the horizon.

    Raises:
        ValueError: there is no table for such a distribution, or it has a mean slope.
    """
    known = _tabulated(distribution)
    return table_loss(_read(NAMES[type(known)]), seen_roughness(known.roughness, w), w[..., 2])


def mean_loss(distribution: Distribution) -> jax.Array:
    """The cosine-weighted mean of 1 - E, of the roughness's shape.

    Raises:
        ValueError: there is no table for such a distribution, or it has a mean slope.
    """
    known = _tabulated(distribution)
    table, roughness = _read(NAMES[type(known)]), known.roughness
    if isinstance(roughness, Isotropic):
        return _scaled_mean(table.isotropic_mean, roughness.alpha)
    axes = principal_axes(roughness.tensor())
    return _scaled_mean(table.general_mean, axes.alpha_x, axes.alpha_y / axes.alpha_x)


def _tabulated(distribution: Distribution) -> Ggx | Beckmann:
    """The distribution, if there is a table for it."""
    if not isinstance(distribution, Ggx | Beckmann):
        raise ValueError(f"distribution is {type(distribution).__name__}; losses are known of Ggx and Beckmann")
    if distribution.slope is not None:
        raise ValueError("distribution has a mean slope; losses are known where it is None")
    return distribution


def table_loss(table: LossTable, seen: Seen, mu: jax.Array) -> jax.Array:
    """1 - E at the cosine mu, `(...)`."""
    place = jnp.sqrt(mu * (1.0 + seen.along) / (mu + seen.along))
    if seen.across is None or seen.mixing is None:
        share = _interpolate(table.isotropic, [place, seen.along])
    else:
        share = _interpolate(table.general, [place, seen.along, seen.across, seen.mixing])
    return share * loss_scale(seen, mu)


def loss_scale(seen: Seen, mu: jax.Array) -> jax.Array:
    """What the tables are relative to."""
    across = seen.along if seen.across is None else seen.across
    squared = mu * mu
    spread = seen.along * seen.along + across * across * squared
    return mu / (mu + seen.along) * spread / (spread + squared)


def seen_roughness(roughness: Roughness, w: jax.Array) -> Seen:
    """The roughness as w sees it; from the normal itself as from azimuth zero."""
    if isinstance(roughness, Isotropic):
        return Seen(roughness.alpha, None, None)
    sin = safe_norm(w[..., :2])
    x, y = jnp.where(sin > 0, safe_divide(w[..., 0], sin), 1.0), safe_divide(w[..., 1], sin)
    along = jnp.stack(roughness.stretch(x, y), axis=-1)
    across = jnp.stack(roughness.stretch(-y, x), axis=-1)
    long, wide = safe_norm(along), safe_norm(across)
    cosine = (along[..., 0] * across[..., 0] + along[..., 1] * across[..., 1]) / (long * wide)
    return Seen(long, wide, jnp.minimum(cosine * cosine, 1.0))


def _scaled_mean(table: np.ndarray, alpha: jax.Array, *rest: jax.Array) -> jax.Array:
    place = 1.0 - jnp.log(alpha) / float(np.log(ROUGHNESS.low))
    return alpha * alpha * jnp.exp(_interpolate(table, [place, *rest]))


def _interpolate(table: np.ndarray, places: Sequence[jax.Array]) -> jax.Array:
    """The table on [0, 1]^n, linearly between its entries.

    All 2^n corners of a cell are taken at once: one by one they take ten times as long to compile.
    """
    steps = [p * float(count - 1) for p, count in zip(jnp.broadcast_arrays(*places), table.shape, strict=True)]
    cells = [jnp.clip(x.astype(jnp.int32), 0, count - 2) for x, count in zip(steps, table.shape, strict=True)]
    strides = np.cumprod([1, *table.shape[:0:-1]])[::-1]
    first = reduce(jnp.add, (cell * int(stride) for cell, stride in zip(cells, strides, strict=True)))
    offsets = jnp.asarray(np.indices((2,) * table.ndim).reshape(table.ndim, -1).T @ strides, jnp.int32)
    index = first[..., None] + match_rank(offsets, first.ndim + 1)
    values = jnp.asarray(table.ravel(), steps[0].dtype)[index]
    for step, cell in zip(steps, cells, strict=True):
        low, high = jnp.split(values, 2, axis=-1)
        values = low + (step - cell)[..., None] * (high - low)
    return values[..., 0]


@lru_cache
def _read(name: str) -> LossTable:
    with files("jaxbrdf.brdf").joinpath(FILE).open("rb") as file, np.load(file) as arrays:
        return LossTable(*(np.asarray(arrays[f"{name}_{field}"], np.float32) for field in LossTable._fields))
