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
from jaxbrdf.fit.split import Split, joined, split
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
        turn: queries, over all devices, after which all but pyramids is updated; None is the batch. Networks learn from
            few queries what places have in common; a texel is met by few of a batch, and to update all texels takes as
            long as many evaluations.
    """

    batch: int
    microbatch: int = 2048
    ema: float = 0.005
    turn: int | None = None


class FitState(NamedTuple):
    """All that training changes.

    Attributes:
        params: as the optimiser sees them.
        average: their exponential moving average, which is the result.
        optimiser: moments of Adam, `Split`.
        step: steps taken, int32 `()`.
    """

    params: Params
    average: Params
    optimiser: Split
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
    moments = Split(*(optimiser.init(part) for part in split(params)))
    return FitState(params, jax.tree.map(jnp.copy, params), moments, jnp.zeros((), jnp.int32))


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
        ValueError: if the batch does not divide into turns, or these into the devices' microbatches.
    """
    share = _Share.of(config, len(devices))
    mesh = Mesh(devices, (AXIS,), axis_types=(AxisType.Auto,))
    step = partial(_step, loss, optimiser, schedule, config, share, feed)
    return Advance(
        run=jax.jit(partial(_sharded_run, mesh, step, feed), compiler_options=known_options(COMPILER_OPTIONS)),
        place_state=lambda state: jax.device_put(state, NamedSharding(mesh, PartitionSpec())),
        place_data=partial(jax.tree.map, lambda leaf: jax.device_put(leaf, NamedSharding(mesh, feed.spec(leaf)))),
    )


class _Share(NamedTuple):
    """What a device does of a step: `turns` times `pieces` of `size` queries."""

    turns: int
    pieces: int
    size: int

    @property
    def queries(self) -> int:
        return self.turns * self.pieces * self.size

    @classmethod
    def of(cls, config: LoopConfig, devices: int) -> _Share:
        """Raises ValueError if it does not divide."""
        if config.turn is not None and config.batch % config.turn:
            raise ValueError(f"turn is {config.turn}; it must divide the batch, {config.batch}")
        name, turn = ("batch", config.batch) if config.turn is None else ("turn", config.turn)
        if turn % devices:
            raise ValueError(f"{name} is {turn}; it must be a multiple of the {devices} devices")
        own = turn // devices
        size = min(config.microbatch, own)
        if own % size:
            raise ValueError(f"microbatch is {size}; it must divide a device's share of the {name}, {own}")
        return cls(config.batch // turn, own // size, size)


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
    share: _Share,
    feed: Feed,
    data: Any,
    steps: jax.Array,
    carry: tuple[FitState, jax.Array],
) -> tuple[FitState, jax.Array]:
    """A step: of pyramids by the gradient of the whole batch, of all else by that of each turn."""
    state, total = carry
    params, factor = split(state.params), schedule(state.step, steps)
    of_turn = partial(_gradient, loss, share, feed, state.step, data)

    def turn(index: jax.Array, carry: _Turned) -> _Turned:
        value, gradient = of_turn(index, joined(Split(carry.shared, params.pyramids)))
        by_shared, by_pyramids = split(gradient)
        value, by_shared = _mean_over_devices((value, by_shared))
        shared, moments = _updated(optimiser, factor, by_shared, carry.moments, carry.shared)
        return _Turned(shared, moments, *jax.tree.map(jnp.add, (carry.value, carry.gradient), (value, by_pyramids)))

    zeros = jax.tree.map(jnp.zeros_like, params.pyramids)
    first = _Turned(params.shared, state.optimiser.shared, jnp.zeros(()), zeros)
    last = jax.lax.fori_loop(0, share.turns, turn, first) if share.turns > 1 else turn(jnp.int32(0), first)
    value, gradient = jax.tree.map(lambda leaf: leaf / share.turns, (last.value, last.gradient))
    pyramids, moments = _updated(
        optimiser, factor, _mean_over_devices(gradient), state.optimiser.pyramids, params.pyramids
    )
    whole = joined(Split(last.shared, pyramids))
    average = optax.incremental_update(whole, state.average, config.ema)
    return FitState(whole, average, Split(last.moments, moments), state.step + 1), total + value


class _Turned(NamedTuple):
    """What the turns of a step change: shared parameters and their moments; sums of the loss and of the gradient by
    pyramids."""

    shared: Any
    moments: Any
    value: jax.Array
    gradient: Any


def _updated(
    optimiser: optax.GradientTransformation, factor: jax.Array, gradient: Any, moments: Any, params: Any
) -> tuple[Any, Any]:
    updates, moments = optimiser.update(gradient, moments, params)
    return jax.tree.map(lambda p, u: p + factor * u, params, updates), moments


def _mean_over_devices(tree: Any) -> Any:
    """One exchange for all leaves: each costs the devices a meeting, which takes longer than the sum."""
    if not jax.tree.leaves(tree):
        return tree
    flat, unravel = ravel_pytree(tree)
    return unravel(jax.lax.pmean(flat, AXIS))


def _gradient(loss: BatchLoss, share: _Share, feed: Feed, step: jax.Array, data: Any, turn: jax.Array, params: Params):
    """Mean loss and gradient of a turn on this device, piece by piece."""

    def one(index: jax.Array):
        piece = Piece(step, share.queries, turn * share.pieces + index, share.size)
        return jax.value_and_grad(loss)(params, feed.batch(data, piece))

    if share.pieces == 1:
        return one(jnp.int32(0))
    zero = jax.tree.map(jnp.zeros_like, (jnp.zeros(()), params))
    sums = jax.lax.fori_loop(0, share.pieces, lambda index, sums: jax.tree.map(jnp.add, sums, one(index)), zero)
    return jax.tree.map(lambda leaf: leaf / share.pieces, sums)
