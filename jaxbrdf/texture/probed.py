"""Lookups with as many probes as each place needs.

Most places need few, so the probes of all are one list without gaps. A probe between two levels is read on both: each
reading is an item of the list, which is worked off in chunks of one size. So a batch takes the time of the probes that
it has, and the memory of a chunk.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.texture.cell import Cell, along_slopes, cell, fetch, rows_of, scatter
from jaxbrdf.texture.footprint import Probes
from jaxbrdf.texture.pyramid import Layout, between_levels

CHUNK = 2048
"""Items of a chunk of batches up to four times as large; those of larger ones have a quarter of the batch."""


class Items(NamedTuple):
    """A chunk of the list.

    Attributes:
        place: whose value each item is part of, ascending.
        weight: its share; zero past the end of the list.
        at: the texels that it reads.
    """

    place: jax.Array
    weight: jax.Array
    at: Cell


class Places(NamedTuple):
    """What items read of their places, laid side by side so that each is read at once.

    Attributes:
        ends: the first item past each place's, `(batch,)`.
        whole: the place's first item, its number of probes, their lower level, `(batch, 3)` int32.
        real: uv, the step between probes, the share of the upper level, the share of a probe, `(batch, 6)`.
    """

    ends: jax.Array
    whole: jax.Array
    real: jax.Array


@jax.custom_vjp
def probed(layout: Layout, texels: jax.Array, uv: jax.Array, probes: Probes) -> jax.Array:
    """Means `(batch, channels)` of the probes about each uv `(batch, 2)`, differentiable in the texels and in uv."""

    def add(out: jax.Array, items: Items) -> jax.Array:
        return _add(out, items, fetch(texels, items.at) * items.weight[:, None])

    return _over_items(layout, uv, probes, add, jnp.zeros((uv.shape[0], texels.shape[1]), texels.dtype))


def _forward(layout: Layout, texels: jax.Array, uv: jax.Array, probes: Probes):
    return probed(layout, texels, uv, probes), (layout, texels, uv, probes)


def _backward(saved: tuple[Layout, jax.Array, jax.Array, Probes], g: jax.Array):
    """The transposes, each in its own loop: one that nothing asks for is not compiled."""
    layout, texels, uv, probes = saved

    def add_texels(out: jax.Array, items: Items) -> jax.Array:
        return scatter(out, items.at, rows_of(g, items.place) * items.weight[:, None])

    def add_uv(out: jax.Array, items: Items) -> jax.Array:
        return _add(out, items, along_slopes(texels, items.at, rows_of(g, items.place) * items.weight[:, None]))

    by_texels = _over_items(layout, uv, probes, add_texels, jnp.zeros_like(texels))
    return None, by_texels, _over_items(layout, uv, probes, add_uv, jnp.zeros_like(uv)), None


probed.defvjp(_forward, _backward)


def _add(out: jax.Array, items: Items, rows: jax.Array) -> jax.Array:
    return out.at[items.place].add(rows, mode="promise_in_bounds", indices_are_sorted=True)


def _over_items(
    layout: Layout, uv: jax.Array, probes: Probes, add: Callable[[jax.Array, Items], jax.Array], out: jax.Array
) -> jax.Array:
    """`out` after `add` of every chunk of the list."""
    if uv.shape[0] == 0:
        return out
    size = max(min(CHUNK, uv.shape[0]), uv.shape[0] // 4)
    places = _places(layout, uv, probes)

    def turn(carry: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        first, out = carry
        return first + size, add(out, _items(layout, places, first + jnp.arange(size, dtype=jnp.int32)))

    return jax.lax.while_loop(lambda carry: carry[0] < places.ends[-1], turn, (jnp.int32(0), out))[1]


def _places(layout: Layout, uv: jax.Array, probes: Probes) -> Places:
    level, share = between_levels(layout, probes.lod)
    counts = jnp.where(share > 0.0, 2 * probes.count, probes.count)
    ends = jnp.cumsum(counts)
    of_probe = 1.0 / probes.count.astype(uv.dtype)
    real = jnp.stack([uv[:, 0], uv[:, 1], probes.u, probes.v, share, of_probe], axis=1)
    return Places(ends, jnp.stack([ends - counts, probes.count, level], axis=1), real)


def _items(layout: Layout, places: Places, number: jax.Array) -> Items:
    """The items of these numbers: of each place first the probes on the lower level, then those on the upper."""
    place = jnp.minimum(jnp.searchsorted(places.ends, number, side="right"), places.ends.shape[0] - 1)
    start, count, level = rows_of(places.whole, place).T
    u, v, step_u, step_v, share, of_probe = rows_of(places.real, place).T
    is_lower = number - start < count
    probe = number - start - jnp.where(is_lower, 0, count)
    steps = probe.astype(u.dtype) - 0.5 * (count - 1).astype(u.dtype)
    weight = jnp.where(is_lower, 1.0 - share, share) * of_probe
    level = jnp.minimum(jnp.where(is_lower, level, level + 1), layout.top)
    at = cell(layout, u + steps * step_u, v + steps * step_v, level)
    return Items(place, jnp.where(number < places.ends[-1], weight, 0.0), at)
