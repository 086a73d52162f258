"""Adam on a whole pyramid of latents, or on the rows alone that a batch reads: what a step of each costs.

    python experiments/bench_texture_updates.py            # about a minute

Both add the gradients of a batch of 8192 queries, their rows as training draws them, to their texels, and update
values, moments and moving average, eight channels a texel, on one thread of XLA's device. "Touched" leaves the moments
and the average of all other rows as they are, so it is another optimiser, whose average would have to be caught up
with when a row is read again. Writes experiments/results/texture_updates.json.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.fit.presets import SURFACE_PRESETS
from jaxbrdf.sampling.footprints import draw_places
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.texture.footprint import probes_of
from jaxbrdf.texture.lookup import anisotropic
from jaxbrdf.texture.pyramid import Layout, between_levels

PRESET = SURFACE_PRESETS["quick"]()
BATCH = PRESET.training.loop.batch
RATES = PRESET.training.optimiser
EMA = PRESET.training.loop.ema
CHANNELS = 8
PROBES = 16
ROUNDS = 25


class State(NamedTuple):
    """Values, moments, average, and a gradient that is zero between steps, each `(texels, channels)`."""

    p: jax.Array
    m: jax.Array
    v: jax.Array
    average: jax.Array
    g: jax.Array


def rows_read(layout: Layout) -> jax.Array:
    """Rows that the transpose of a batch's lookups adds to, as many as there are, of those that it reads."""
    keys = jax.random.split(jax.random.key(0), 2)
    wo = square_to_cosine(jax.random.uniform(keys[0], (BATCH, 2)))
    uv, footprint = draw_places(keys[1], wo, texels=layout.width, crowding=PRESET.draws.crowding)
    probes = probes_of(layout, footprint, most=PROBES)
    share = between_levels(layout, probes.lod)[1]
    count = 4 * int(jnp.sum(jnp.where(share > 0, 2 * probes.count, probes.count)))
    ones = jnp.ones((layout.texels, 1))
    touched = jax.grad(lambda texels: jnp.sum(anisotropic(layout, texels, uv, footprint, probes=PROBES)))(ones)
    rows = np.flatnonzero(np.asarray(touched))
    return jnp.asarray(np.random.default_rng(0).choice(rows, count), jnp.int32)


def adam(g: jax.Array, p: jax.Array, m: jax.Array, v: jax.Array, average: jax.Array):
    """One step of Adam, its first moments' bias left aside, and of the average."""
    m, v = RATES.beta1 * m + (1 - RATES.beta1) * g, RATES.beta2 * v + (1 - RATES.beta2) * g * g
    p = p - RATES.spatial_rate * m / (jnp.sqrt(v) + RATES.epsilon)
    return p, m, v, average + EMA * (p - average)


def dense(rows: jax.Array, values: jax.Array, state: State) -> State:
    g = jnp.zeros_like(state.p).at[rows].add(values, mode="promise_in_bounds")
    return State(*adam(g, state.p, state.m, state.v, state.average), state.g)


def touched(rows: jax.Array, values: jax.Array, state: State) -> State:
    """A row that stands twice is written twice, with the same numbers."""
    g = state.g.at[rows].add(values, mode="promise_in_bounds")
    old = g, state.p, state.m, state.v, state.average
    held, p, m, v, average = (array.at[rows].get(mode="promise_in_bounds") for array in old)
    arrays = zip(state[:4], adam(held, p, m, v, average), strict=True)
    p, m, v, average = (array.at[rows].set(part, mode="promise_in_bounds") for array, part in arrays)
    return State(p, m, v, average, g.at[rows].set(0.0, mode="promise_in_bounds"))


def measured(size: int) -> dict[str, float]:
    layout = Layout(size, size)
    rows = rows_read(layout)
    values = jax.random.normal(jax.random.key(1), (len(rows), CHANNELS))
    # rows are arguments and steps are calls of their own: otherwise XLA adds the constant gradient once and for all
    runs = {step.__name__: jax.jit(step, donate_argnums=2) for step in (dense, touched)}
    states = {name: State(*(jnp.zeros((layout.texels, CHANNELS)) for _ in range(5))) for name in runs}
    times: dict[str, list[float]] = {name: [] for name in runs}
    for index in range(ROUNDS + 1):
        for name, run in runs.items():
            clock = time.perf_counter()
            states[name] = jax.block_until_ready(run(rows, values, states[name]))
            times[name] += [time.perf_counter() - clock] if index else []
    milliseconds = {f"{name}_ms": 1e3 * float(np.median(of)) for name, of in times.items()}
    return milliseconds | {"rows_added": len(rows), "rows_touched": len(np.unique(rows)), "texels": layout.texels}


def main() -> None:
    result = {"load": os.getloadavg()[0]} | {str(size): measured(size) for size in (256, 1024)}
    path = Path(__file__).parent / "results" / "texture_updates.json"
    path.write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
