"""The training loop as one jitted function of its whole state.

It knows only a loss of (params, batch), and a feed that gives each device its share of every batch
(`jaxbrdf.fit.feed`); gradients are averaged over devices, so parameters stay the same on all. The same seed and devices
give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import optax
from jax.flatten_util import ravel_pytree
from jax.sharding import AxisType, Mesh, NamedSharding, PartitionSpec

from jaxbrdf.core.compiler import known_options
from jaxbrdf.fit.batch import Batch
from jaxbrdf.fit.feed import AXIS, POOLED, Feed, Piece
from jaxbrdf.types import Params

BatchLoss = Callable[[Params, Batch], jax.Array]
Schedule = Callable[[jax.Array, jax.Array], jax.Array]

COMPILER_OPTIONS = {"xla_cpu_experimental_ynn_fusion_type": "LIBRARY_FUSION_TYPE_INDIVIDUAL_DOT"}
"""XLA's library for the processor gets matrix products alone: reductions so small cost its threads more than they save.

A seventh of the time of a step, with jaxlib 0.10.2.
"""


@dataclass(frozen=True)
class LoopConfig:
    """How steps are made of queries.

    Attributes:
        batch: queries a step, over all devices.
        microbatch: queries a device evaluates at once; gradients of a larger share are summed over such pieces, which
            stay in the processor's cache.
        ema: weight of the newest parameters in the exponential moving average.
    """

    batch: int
    microbatch: int = 2048
    ema: float = 0.005


class FitState(NamedTuple):
    """All that training changes.

    Attributes:
        params: as the optimiser sees them.
        average: their exponential moving average, which is the result.
        optimiser: moments of Adam.
        step: steps taken, int32 `()`.
    """

    params: Params
    average: Params
    optimiser: Any
    step: jax.Array


class Advance(NamedTuple):
    """The compiled loop.

    Attributes:
        run: `(state, data, count, steps) -> (state, mean loss)`, `count` steps of a training of `steps`, with the data
            that the feed reads; ValueError if it refuses them.
        place_state, place_data: put arrays where `run` wants them.
    """

    run: Callable[[FitState, Any, jax.Array, jax.Array], tuple[FitState, jax.Array]]
    place_state: Callable[[FitState], FitState]
    place_data: Callable[[Any], Any]


def start(params: Params, optimiser: optax.GradientTransformation) -> FitState:
    """The state before the first step."""
    return FitState(params, jax.tree.map(jnp.copy, params), optimiser.init(params), jnp.zeros((), jnp.int32))


def compile_advance(
    loss: BatchLoss,
    optimiser: optax.GradientTransformation,
    schedule: Schedule,
    config: LoopConfig,
    devices: Sequence[Any],
    *,
    feed: Feed = POOLED,
) -> Advance:
    """The loop for `devices`, by default over a pool of queries.

    Raises:
        ValueError: if the batch does not divide into the devices' microbatches.
    """
    if config.batch % len(devices):
        raise ValueError(f"batch is {config.batch}; it must be a multiple of the {len(devices)} devices")
    share = config.batch // len(devices)
    if share % min(config.microbatch, share):
        raise ValueError(f"microbatch is {config.microbatch}; it must divide a device's share of the batch, {share}")
    mesh = Mesh(devices, (AXIS,), axis_types=(AxisType.Auto,))
    step = partial(_step, loss, optimiser, schedule, config, share, feed)
    return Advance(
        run=jax.jit(partial(_sharded_run, mesh, step, feed), compiler_options=known_options(COMPILER_OPTIONS)),
        place_state=lambda state: jax.device_put(state, NamedSharding(mesh, PartitionSpec())),
        place_data=partial(jax.tree.map, lambda leaf: jax.device_put(leaf, NamedSharding(mesh, feed.spec(leaf)))),
    )


def _sharded_run(
    mesh: Mesh, step: Callable, feed: Feed, state: FitState, data: Any, count: jax.Array, steps: jax.Array
):
    def run(state: FitState, data: Any, count: jax.Array, steps: jax.Array) -> tuple[FitState, jax.Array]:
        first = (state, jnp.zeros(()))
        state, total = jax.lax.fori_loop(0, count, lambda _, carry: step(data, steps, carry), first)
        return state, total / count

    specs = (PartitionSpec(), jax.tree.map(feed.spec, data), PartitionSpec(), PartitionSpec())
    mapped = jax.shard_map(run, mesh=mesh, in_specs=specs, out_specs=PartitionSpec(), check_vma=False)
    return mapped(state, data, count, steps)


def _step(
    loss: BatchLoss,
    optimiser: optax.GradientTransformation,
    schedule: Schedule,
    config: LoopConfig,
    share: int,
    feed: Feed,
    data: Any,
    steps: jax.Array,
    carry: tuple[FitState, jax.Array],
) -> tuple[FitState, jax.Array]:
    state, total = carry
    value, gradient = _mean_over_devices(_gradient(loss, config, share, feed, state, data))
    updates, moments = optimiser.update(gradient, state.optimiser, state.params)
    factor = schedule(state.step, steps)
    params = jax.tree.map(lambda p, u: p + factor * u, state.params, updates)
    average = optax.incremental_update(params, state.average, config.ema)
    return FitState(params, average, moments, state.step + 1), total + value


def _mean_over_devices(tree: Any) -> Any:
    """One exchange for all leaves: each costs the devices a meeting, which takes longer than the sum."""
    flat, unravel = ravel_pytree(tree)
    return unravel(jax.lax.pmean(flat, AXIS))


def _gradient(loss: BatchLoss, config: LoopConfig, share: int, feed: Feed, state: FitState, data: Any):
    """Loss and gradient of this device's share of the next batch, piece by piece."""
    size = min(config.microbatch, share)
    pieces = share // size

    def one(index: jax.Array):
        return jax.value_and_grad(loss)(state.params, feed.batch(data, Piece(state.step, share, index, size)))

    if pieces == 1:
        return one(jnp.int32(0))
    zero = jax.tree.map(jnp.zeros_like, (jnp.zeros(()), state.params))
    sums = jax.lax.fori_loop(0, pieces, lambda index, sums: jax.tree.map(jnp.add, sums, one(index)), zero)
    return jax.tree.map(lambda leaf: leaf / pieces, sums)
