"""What a training reads: pools of queries of one reflectance, or new queries of a surface in every step."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.fit import pool
from jaxbrdf.fit.batch import Batch
from jaxbrdf.fit.feed import POOLED, Drawing, Feed, drawn
from jaxbrdf.fit.presets import Preset
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.surface.draws import SurfaceDraws, draw_targets
from jaxbrdf.texture.pyramid import Pyramid
from jaxbrdf.types import Model, Query

FOREVER = 2**31 - 1
"""The last step that there may be."""

HELD_OUT = 2**14
HELD_OUT_SAMPLES = 64
"""Points of the footprint of a held-out target."""

EVEN = 1e-3
"""Crowding of held-out footprints: their scales are even, so that coarse ones count as much as fine ones."""

DRAWING_SHARE = 1 / 3
"""The most of a budget that drawing the first pool may take."""


class Supply(NamedTuple):
    """Data for the training loop.

    Attributes:
        feed: how the loop reads them.
        load: the data of a number.
        reads: of a step the number of the data that it reads, and the first step that may read others.
        typical: of loaded data, queries by which losses are scaled and the decoder's first value is chosen.
        held_out: queries that no step sees.
        told: what loading the first data is.
        pool: queries of a pool; zero where there is none.
    """

    feed: Feed
    load: Callable[[int], Any]
    reads: Callable[[int], tuple[int, int]]
    typical: Callable[[Any], Batch]
    held_out: Callable[[], Batch]
    told: str
    pool: int


@dataclass(frozen=True)
class Wanted:
    """What a training wants of its supply.

    Attributes:
        model: whose coordinates it reads.
        preset: the recipe.
        seed: of draws.
        pool: queries of a pool, where an interrupted training had decided; None to decide now.
        budget_seconds: of the whole training, if there is one.
    """

    model: Model
    preset: Preset
    seed: int
    pool: int | None = None
    budget_seconds: float | None = None


Supplier = Callable[[Wanted], Supply]


def key_of(seed: int, purpose: str) -> jax.Array:
    """The key of a purpose, so that no two share draws."""
    return jax.random.fold_in(jax.random.key(seed), ("params", "held out", "pool").index(purpose))


def cosine_draws(key: jax.Array, count: int) -> tuple[Query, jax.Array]:
    """Cosine-distributed pairs, the paper's draws, each of importance one."""
    u = jax.random.uniform(key, (2, count, 2))
    return Query(square_to_cosine(u[0]), square_to_cosine(u[1])), jnp.ones(count)


def pools_of(truth: Callable[[Query], jax.Array]) -> Supplier:
    """Pools of `query -> f`, a compiled function; a small budget draws a small one."""

    def supply(wanted: Wanted) -> Supply:
        preset = wanted.preset
        count = wanted.pool or _affordable_pool(truth, wanted)

        def load(number: int) -> Batch:
            return _draw_pool(truth, wanted, jax.random.fold_in(key_of(wanted.seed, "pool"), number), count)

        def reads(step: int) -> tuple[int, int]:
            if not preset.passes:
                return 0, FOREVER
            lasts = preset.passes * count // preset.loop.batch
            return step // lasts, (step // lasts + 1) * lasts

        def held_out() -> Batch:
            return pool.draw_pool(key_of(wanted.seed, "held out"), HELD_OUT, draw_weighted, truth, wanted.model.encode)

        told = f"drawing {count:,} training queries"
        return Supply(POOLED, load, reads, lambda data: data, held_out, told, count)

    return supply


def _draw_pool(truth: Callable[[Query], jax.Array], wanted: Wanted, key: jax.Array, count: int) -> Batch:
    draws = draw_weighted if wanted.preset.highlights else cosine_draws
    return pool.draw_pool(key, count, draws, truth, wanted.model.encode)


def _affordable_pool(truth: Callable[[Query], jax.Array], wanted: Wanted) -> int:
    """Queries of the preset's pool, or fewer where drawing them would eat the budget: at least a batch."""
    preset = wanted.preset
    if wanted.budget_seconds is None:
        return preset.pool
    least = max(pool.CHUNK, preset.loop.batch)
    draw = partial(_draw_pool, truth, wanted, key_of(wanted.seed, "pool"), least)
    draw()
    clock = time.perf_counter()
    draw()
    affordable = DRAWING_SHARE * wanted.budget_seconds / (time.perf_counter() - clock)
    return min(preset.pool, least * max(1, int(affordable)))


def draws_of(surface: Pyramid, draws: SurfaceDraws) -> Supplier:
    """New queries of a surface in every step, with targets of `draws.samples` points."""

    def supply(wanted: Wanted) -> Supply:
        even = replace(draws, samples=HELD_OUT_SAMPLES, crowding=EVEN, scattered=False)
        judged = jax.jit(_batches(surface, even, wanted.model), static_argnums=2)

        def load(_: int) -> Drawing:
            return Drawing(jnp.int32(wanted.seed), surface.texels)

        def held_out() -> Batch:
            return jax.tree.map(np.asarray, judged(key_of(wanted.seed, "held out"), surface.texels, HELD_OUT))

        def typical(_: Drawing) -> Batch:
            return jax.tree.map(np.asarray, judged(key_of(wanted.seed, "pool"), surface.texels, HELD_OUT))

        told = f"training on new draws in every step, each target a mean of {draws.samples} points of its footprint"
        feed = drawn(_batches(surface, draws, wanted.model))
        return Supply(feed, load, lambda _: (0, FOREVER), typical, held_out, told, 0)

    return supply


def _batches(surface: Pyramid, draws: SurfaceDraws, model: Model) -> Callable[[jax.Array, jax.Array, int], Batch]:
    draw = draw_targets(surface.layout, draws)

    def batch(key: jax.Array, texels: jax.Array, count: int) -> Batch:
        targets = draw(key, texels, count)
        return Batch(model.encode(targets.query), targets.f.T, jnp.ones(count))

    return batch
