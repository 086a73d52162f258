"""The training of one model on one material, from its first draws to its averaged parameters, resumable at any step."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.errors import DataError, FitError
from jaxbrdf.fit import checkpoint, loop, losses
from jaxbrdf.fit.batch import Batch
from jaxbrdf.fit.optimiser import adam
from jaxbrdf.fit.presets import Preset
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.supply import Supplier, Supply, Wanted, key_of
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.types import Model, Params

STRIDE = 200
STRIDE_QUERIES = 2**22
"""The most steps, and the most queries, between looks at the clock, the loss and the keyboard: about a second."""

SECONDS_BETWEEN_CHECKPOINTS = 10.0
TRIAL_STEPS = 100

DIVERGED = 1.95
"""Held-out SMAPE of a fit that is lost to huge values: 2 is the most there is; a dark material may begin at 1.5."""


@dataclass(frozen=True)
class Task:
    """What is trained, on what, and how.

    Attributes:
        model: the learned reflectance.
        supplier: of queries and targets.
        preset: the recipe.
        seed: of parameters and draws.
        checkpoint: the file of the running state.
        record: what the checkpoint says that it belongs to.
        init: `key -> params` to start from; by default the model's own.
    """

    model: Model
    supplier: Supplier
    preset: Preset
    seed: int
    checkpoint: Path
    record: dict[str, Any]
    init: Callable[[jax.Array], Params] | None = None


class Trained(NamedTuple):
    """The result of a training.

    Attributes:
        params: the averaged parameters.
        steps: taken in all.
        cost: `fit_seconds` (drawing and training), `draw_seconds` of them, `compile_seconds`, `queries_per_second`.
        findings: what else a report should have.
    """

    params: Params
    steps: int
    cost: dict[str, float]
    findings: Mapping[str, Any] = MappingProxyType({})


class _Prepared(NamedTuple):
    """Everything that training needs besides its state."""

    advance: loop.Advance
    supply: Supply
    data: Any
    held_out: Batch
    error: Callable[[Params, Batch], jax.Array]
    seconds: dict[str, float]


def train(task: Task, budget_seconds: float | None, resume: bool, reporter: Reporter) -> Trained:
    """Trains to the preset's end, or to what the budget allows.

    Raises:
        FitError: if the fit diverges, or there is nothing to resume; the last checkpoint is kept.
        DataError: if the checkpoint cannot be read or written.
    """
    record = _resumable(task) if resume else None
    pool = None if record is None else record["pool"]
    prepared, state = _prepare(task, Wanted(task.model, task.preset, task.seed, pool, budget_seconds), reporter)
    if record is not None:
        state = prepared.advance.place_state(checkpoint.load(task.checkpoint, like=jax.tree.map(np.asarray, state)))
        steps, spent = record["steps"], record["seconds"]
    else:
        steps, spent = _planned_steps(task, prepared, budget_seconds), 0.0
    _tell_cost(task, prepared, steps, reporter)
    clock = time.perf_counter()
    state = _run(task, prepared, state, steps, spent, reporter)
    trained = spent + time.perf_counter() - clock
    return Trained(jax.tree.map(np.asarray, state.average), steps, _cost(task, prepared, steps, trained))


def step_timer(task: Task, reporter: Reporter) -> Callable[[], float]:
    """Prepares a training and returns a function that measures the seconds of a step anew, compilation left out."""
    prepared, state = _prepare(task, Wanted(task.model, task.preset, task.seed), reporter)
    return lambda: _timed(task, prepared.advance, state, prepared.data)


def _resumable(task: Task) -> dict[str, Any]:
    if not task.checkpoint.exists():
        raise FitError(f"{task.checkpoint}: no checkpoint to resume")
    record = checkpoint.read_record(task.checkpoint)
    for name, value in task.record.items():
        if record.get(name) != value:
            raise FitError(f"{task.checkpoint}: was made with {name} {record.get(name)!r}, not {value!r}")
    types = {"steps": int, "pool": int, "seconds": float}
    if any(type(record.get(name)) is not kind for name, kind in types.items()):
        raise DataError(task.checkpoint, "a checkpoint that does not say how many steps were planned")
    return record


def _prepare(task: Task, wanted: Wanted, reporter: Reporter) -> tuple[_Prepared, loop.FitState]:
    """Draws, compiles and times; the state is that before the first step."""
    supply = task.supplier(wanted)
    reporter.say(supply.told)
    clock = time.perf_counter()
    data = supply.load(0)
    seconds = {"draw": time.perf_counter() - clock}
    typical = supply.typical(data)
    scale = losses.scale_of(typical)
    advance = loop.compile_advance(
        partial(_loss, task, scale),
        adam(task.preset.optimiser),
        task.preset.schedule,
        task.preset.loop,
        jax.devices(),
        feed=supply.feed,
    )
    placed, state = advance.place_data(data), _first_state(task, typical)
    clock = time.perf_counter()
    jax.block_until_ready(advance.run(advance.place_state(state), placed, jnp.int32(1), jnp.int32(1)))
    seconds["compile"] = time.perf_counter() - clock
    seconds["step"] = _timed(task, advance, advance.place_state(state), placed)
    error = jax.jit(partial(_smape, task))
    return _Prepared(advance, supply, placed, supply.held_out(), error, seconds), advance.place_state(state)


def _timed(task: Task, advance: loop.Advance, state: loop.FitState, placed: Any) -> float:
    """Seconds of a step."""
    count = min(TRIAL_STEPS, _stride(task.preset))
    clock = time.perf_counter()
    jax.block_until_ready(advance.run(state, placed, jnp.int32(count), jnp.int32(count)))
    return (time.perf_counter() - clock) / count


def _first_state(task: Task, typical: Batch) -> loop.FitState:
    """Initial parameters whose constant part is the material's typical value, so that training starts in range."""
    params = (task.init or task.model.init)(key_of(task.seed, "params"))
    # by numpy, which selects where XLA sorts: for two million queries that is seconds
    median = jnp.log(jnp.asarray(np.median(typical.target, axis=1)) + losses.SMAPE_OFFSET)
    if isinstance(params, Mlp):
        params = _with_offset(params, median)
    elif hasattr(params, "mlp"):
        params = params._replace(mlp=_with_offset(params.mlp, median))
    return loop.start(params, adam(task.preset.optimiser))


def _with_offset(decoder: Mlp, offset: jax.Array) -> Mlp:
    return decoder._replace(biases=(*decoder.biases[:-1], offset))


def _loss(task: Task, scale: losses.Scale, params: Params, batch: Batch) -> jax.Array:
    return jnp.mean(task.preset.loss(task.model.decode(params, batch.coordinates), batch, scale))


def _smape(task: Task, params: Params, batch: Batch) -> jax.Array:
    p = jnp.exp(task.model.decode(params, batch.coordinates))
    relative = 2.0 * jnp.abs(p - batch.target) / (p + batch.target + losses.SMAPE_OFFSET)
    return jnp.mean(batch.importance[None] * relative)


def _planned_steps(task: Task, prepared: _Prepared, budget_seconds: float | None) -> int:
    if budget_seconds is None:
        return task.preset.steps
    return max(1, int((budget_seconds - prepared.seconds["draw"]) / prepared.seconds["step"]))


def _tell_cost(task: Task, prepared: _Prepared, steps: int, reporter: Reporter) -> None:
    queries, seconds = steps * task.preset.loop.batch, steps * prepared.seconds["step"]
    cost = f"{queries / 1e6:,.0f} M queries, about {seconds:,.0f} s on this machine"
    reporter.say(f"{task.preset.name}: {steps:,} steps, {cost}")


def _cost(task: Task, prepared: _Prepared, steps: int, seconds: float) -> dict[str, float]:
    return {
        "fit_seconds": prepared.seconds["draw"] + seconds,
        "draw_seconds": prepared.seconds["draw"],
        "compile_seconds": prepared.seconds["compile"],
        "queries_per_second": steps * task.preset.loop.batch / seconds,
    }


def _run(
    task: Task, prepared: _Prepared, state: loop.FitState, steps: int, spent: float, reporter: Reporter
) -> loop.FitState:
    """Advances to `steps`, with a checkpoint every few seconds and one at an interruption."""
    clock = saved = time.perf_counter()

    def save(state: loop.FitState) -> float:
        elapsed = spent + time.perf_counter() - clock
        record = {**task.record, "steps": steps, "pool": prepared.supply.pool, "seconds": elapsed}
        checkpoint.save(task.checkpoint, state, record)
        return time.perf_counter()

    save(state)
    with reporter.steps("fitting", steps) as tell:
        try:
            for latest, loss in _strides(task, prepared, state, steps):
                error = _held_out_error(prepared, latest)
                _check_sound(task, int(latest.step), loss, error)
                state = latest
                tell(int(state.step), f"loss {loss:.4f}, held-out SMAPE {error:.4f}")
                if time.perf_counter() - saved > SECONDS_BETWEEN_CHECKPOINTS:
                    saved = save(state)
        except KeyboardInterrupt:
            save(state)
            raise
    return state


def _held_out_error(prepared: _Prepared, state: loop.FitState) -> float:
    return float(prepared.error(jax.device_get(state.average), prepared.held_out))


def _check_sound(task: Task, step: int, loss: float, error: float) -> None:
    """Stops before a bad state is saved: the loss is that before each step, so the held-out error must hold too."""
    if not (math.isfinite(loss) and error < DIVERGED):
        raise FitError(
            f"the fit diverged before step {step}: loss {loss:.4g}, held-out SMAPE {error:.4g}; "
            f"the last good state is kept in {task.checkpoint}"
        )


def _strides(
    task: Task, prepared: _Prepared, state: loop.FitState, steps: int
) -> Iterator[tuple[loop.FitState, float]]:
    """States and losses stride by stride, drawing further pools where the preset asks for them."""
    done, held, placed = int(state.step), 0, prepared.data
    while done < steps:
        number, until = prepared.supply.reads(done)
        if number != held:
            held, placed = number, prepared.advance.place_data(prepared.supply.load(number))
        count = min(_stride(task.preset), steps - done, until - done)
        state, loss = prepared.advance.run(state, placed, jnp.int32(count), jnp.int32(steps))
        done += count
        yield state, float(loss)


def _stride(preset: Preset) -> int:
    return max(1, min(STRIDE, STRIDE_QUERIES // preset.loop.batch))
