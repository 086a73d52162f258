"""Random queries of a surface with noisy targets, as training draws them in every step.

Places and footprints are those of Timonen et al., Eq. 9 (`jaxbrdf.sampling.footprints`); viewers are
cosine-distributed, and so is the light of half of the queries, as in the paper. The other half's is drawn as a random
point of the footprint would scatter it: under a footprint of thousands of normals, cosine-distributed light almost
never meets the highlight of one that matters. Targets are unbiased means over other points of the footprint, so a loss
whose expected minimum is the mean may be fitted to them (Lehtinen et al. 2018).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.directions import above_horizon
from jaxbrdf.sampling import footprints
from jaxbrdf.sampling.footprints import draw_places
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.surface.prefilter import gaussian_point, prefiltered, query_at
from jaxbrdf.surface.textured import reciprocal_textured
from jaxbrdf.texture.pyramid import Layout
from jaxbrdf.types import Brdf, Query


@dataclass(frozen=True)
class SurfaceDraws:
    """How queries of a surface are drawn.

    Attributes:
        samples: points of the footprint that a target is the mean of.
        crowding: how much finer footprints are preferred (`jaxbrdf.sampling.footprints.CROWDING`).
        scattered: whether half of the light is drawn as points scatter it; otherwise all is cosine-distributed.
        stretched: whether footprints are as long as a slanted view makes them; otherwise all are round.
    """

    samples: int
    crowding: float = footprints.CROWDING
    scattered: bool = True
    stretched: bool = True


class Targets(NamedTuple):
    """Queries `(n, ...)` and unbiased estimates of f, `(n, 3)`."""

    query: Query
    f: jax.Array


def draw_targets(layout: Layout, config: SurfaceDraws) -> Callable[[jax.Array, jax.Array, int], Targets]:
    """The drawing function `(key, texels, count) -> Targets` for surfaces of a layout, of their reciprocal part.

    Raises:
        ValueError: fewer than one sample.
    """
    brdf = reciprocal_textured(layout)
    estimate = prefiltered(brdf.eval, samples=config.samples)

    def draw(key: jax.Array, texels: jax.Array, count: int) -> Targets:
        key_query, key_target = jax.random.split(key)
        query = _draw_query(key_query, layout, config, brdf, texels, count)
        return Targets(query, estimate(key_target, texels, query))

    return draw


def _draw_query(
    key: jax.Array, layout: Layout, config: SurfaceDraws, brdf: Brdf, texels: jax.Array, count: int
) -> Query:
    key_view, key_light, key_place, key_point = jax.random.split(key, 4)
    wo, wi = (square_to_cosine(jax.random.uniform(k, (count, 2))) for k in (key_view, key_light))
    longer = max(layout.height, layout.width)
    uv, footprint = draw_places(key_place, wo, texels=longer, crowding=config.crowding, stretched=config.stretched)
    query = Query(wi, wo, uv, footprint)
    if not config.scattered:
        return query
    half = jax.tree.map(lambda leaf: leaf[: count // 2], query)
    scattered = _scattered(key_point, brdf, texels, half)
    return query._replace(wi=jnp.concatenate([scattered, wi[count // 2 :]]))


def _scattered(key: jax.Array, brdf: Brdf, texels: jax.Array, query: Query) -> jax.Array:
    """Light as a point of each footprint scatters it; the query's own where that is lost below the horizon."""
    u = jax.random.uniform(key, (*query.wi.shape[:-1], 5))
    wi = sampler_of(brdf).sample(texels, query_at(query, gaussian_point(u[..., :2])), u[..., 2:]).wi
    return jnp.where(above_horizon(wi, query.wo)[..., None], wi, query.wi)
