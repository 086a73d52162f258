"""The compiled loop against the same training written as a Python loop, and against itself."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from jaxbrdf.fit.batch import Batch
from jaxbrdf.fit.loop import Advance, FitState, LoopConfig, compile_advance, start
from jaxbrdf.texture.pyramid import Layout, Pyramid
from tests.fit.batches import batch_of

POOL, STEPS, RATE, EMA = 256, 23, 0.05, 0.1


class Line(NamedTuple):
    """f = slope x + offset, `(3,)` each."""

    slope: jax.Array
    offset: jax.Array


def square(params: Line, batch: Batch) -> jax.Array:
    p = params.slope[:, None] * batch.coordinates[None] + params.offset[:, None]
    return jnp.mean(batch.importance[None] * (p - batch.target) ** 2)


def falling(step: jax.Array, steps: jax.Array) -> jax.Array:
    return 1.0 - step / steps


def pool() -> Batch:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, POOL)
    f = np.array([[2.0], [-1.0], [0.5]]) * x + np.array([[0.1], [0.2], [0.3]]) + 0.1 * rng.standard_normal((3, POOL))
    return batch_of(f, rng.uniform(0.5, 1.5, POOL), x)


def first_state() -> FitState:
    return start(Line(jnp.zeros(3), jnp.ones(3)), optax.scale(-RATE))


def compiled(config: LoopConfig, devices: int = 2, loss=square) -> Advance:
    return compile_advance(loss, optax.scale(-RATE), falling, config, jax.devices()[:devices])


def run(advance: Advance, counts: tuple[int, ...] = (STEPS,)) -> tuple[FitState, float]:
    state, placed, loss = advance.place_state(first_state()), advance.place_data(pool()), jnp.zeros(())
    for count in counts:
        state, loss = advance.run(state, placed, jnp.int32(count), jnp.int32(sum(counts)))
    return state, float(loss)


def plain(batch: int, devices: int) -> tuple[Line, Line, float]:
    """Parameters, average and mean loss of gradient descent in float64; a device's share is a slice of its part."""
    x, f, weight = (np.asarray(leaf, np.float64) for leaf in pool())
    held, share = POOL // devices, batch // devices
    slope, offset = np.zeros(3), np.ones(3)
    average, total = (slope, offset), 0.0
    for step in range(STEPS):
        begin = step % (held // share) * share
        at = np.concatenate([np.arange(d * held + begin, d * held + begin + share) for d in range(devices)])
        error = slope[:, None] * x[at] + offset[:, None] - f[:, at]
        total += np.mean(weight[at] * error**2)
        rate = RATE * (1 - step / STEPS) * 2 / 3
        slope = slope - rate * np.mean(weight[at] * error * x[at], axis=1)
        offset = offset - rate * np.mean(weight[at] * error, axis=1)
        average = tuple((1 - EMA) * a + EMA * new for a, new in zip(average, (slope, offset), strict=True))
    return Line(slope, offset), Line(*average), total / STEPS


@pytest.mark.parametrize(("batch", "microbatch", "devices"), [(32, 16, 2), (32, 4, 2), (64, 64, 1), (256, 32, 2)])
def test_it_is_gradient_descent_over_slices_of_the_pool(batch: int, microbatch: int, devices: int):
    """Whole shares, shares in pieces, one device, and a batch that is the whole pool."""
    state, loss = run(compiled(LoopConfig(batch, microbatch, EMA), devices))
    params, average, mean_loss = plain(batch, devices)
    assert int(state.step) == STEPS
    assert loss == pytest.approx(mean_loss, rel=1e-5)
    for found, expected in zip((*state.params, *state.average), (*params, *average), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


class Relief(NamedTuple):
    """f = slope x + the height of the one texel of a pyramid, `(3,)` each."""

    slope: jax.Array
    heights: Pyramid


def on_relief(params: Relief, batch: Batch) -> jax.Array:
    return square(Line(params.slope, params.heights.texels[0]), batch)


def in_turns(batch: int, microbatch: int) -> tuple[np.ndarray, np.ndarray]:
    """Slope and height in float64, on one device: the slope moves after every microbatch, the height by their mean."""
    x, f, weight = (np.asarray(leaf, np.float64) for leaf in pool())
    slope, height = np.zeros(3), np.zeros(3)
    for step in range(STEPS):
        rate, down = RATE * (1 - step / STEPS) * 2 / 3, []
        for begin in range(0, batch, microbatch):
            at = step % (POOL // batch) * batch + begin + np.arange(microbatch)
            error = weight[at] * (slope[:, None] * x[at] + height[:, None] - f[:, at])
            slope = slope - rate * np.mean(error * x[at], axis=1)
            down.append(np.mean(error, axis=1))
        height = height - rate * np.mean(down, axis=0)
    return slope, height


def test_in_turns_what_is_shared_moves_after_every_microbatch_and_pyramids_once_a_step():
    first = Relief(jnp.zeros(3), Pyramid(Layout(1, 1), jnp.zeros((1, 3))))
    advance = compiled(LoopConfig(64, 8, EMA, turn=16), devices=1, loss=on_relief)
    state, _ = advance.run(
        advance.place_state(start(first, optax.scale(-RATE))),
        advance.place_data(pool()),
        jnp.int32(STEPS),
        jnp.int32(STEPS),
    )
    slope, height = in_turns(64, 16)
    np.testing.assert_allclose(state.params.slope, slope, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(state.params.heights.texels[0], height, rtol=1e-5, atol=1e-6)


def test_the_same_start_gives_the_same_bits_however_the_steps_are_counted():
    config = LoopConfig(32, 8, EMA)
    once, again = run(compiled(config))[0], run(compiled(config))[0]
    in_parts = run(compiled(config), (1, 15, 7))[0]
    for leaf, *others in zip(*(jax.tree.leaves(state) for state in (once, again, in_parts)), strict=True):
        for other in others:
            np.testing.assert_array_equal(leaf, other)


def test_every_count_of_steps_runs_the_one_compiled_loop():
    traces = []

    def counted(params: Line, batch: Batch) -> jax.Array:
        traces.append(batch.importance.shape)
        return square(params, batch)

    advance = compiled(LoopConfig(32, 8, EMA), loss=counted)
    run(advance, (1,))
    first = len(traces)
    run(advance, (1, 3, 5, 14))
    assert first > 0
    assert len(traces) == first
    assert set(traces) == {(8,)}


def test_a_batch_that_does_not_divide_is_refused():
    with pytest.raises(ValueError, match="batch is 33; it must be a multiple of the 2 devices"):
        compiled(LoopConfig(33))


def test_a_share_that_does_not_divide_into_microbatches_is_refused():
    with pytest.raises(ValueError, match="microbatch is 12; it must divide a device's share of the batch, 16"):
        compiled(LoopConfig(32, 12))


def test_a_batch_that_does_not_divide_into_turns_is_refused():
    with pytest.raises(ValueError, match="turn is 12; it must divide the batch, 32"):
        compiled(LoopConfig(32, 8, turn=12))
    with pytest.raises(ValueError, match="turn is 1; it must be a multiple of the 2 devices"):
        compiled(LoopConfig(32, 8, turn=1))


def test_a_pool_smaller_than_a_batch_is_refused():
    with pytest.raises(ValueError, match=f"the pool holds {POOL // 2} queries for each device; a batch takes {POOL}"):
        run(compiled(LoopConfig(2 * POOL)))
