"""A training: it learns, it goes on with the same bits wherever it was stopped, and it stops before it is lost."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import safetensors.numpy

from jaxbrdf.core.directions import half_vector
from jaxbrdf.errors import DataError, FitError, JaxbrdfError
from jaxbrdf.fit import checkpoint, pool
from jaxbrdf.fit.presets import Preset
from jaxbrdf.jobs import training
from jaxbrdf.jobs.supply import pools_of
from jaxbrdf.jobs.training import Task, Trained, train
from jaxbrdf.models.nbrdf import NbrdfConfig, nbrdf
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Query
from tests.jobs.tiny import TINY, Listener

PREPARE = training._prepare
MODEL = nbrdf(NbrdfConfig(hidden=(12,)))
NEW_POOLS = dataclasses.replace(TINY, passes=7)
"""Seven passes are 224 steps: the third pool is in use when the training ends, the second when it is interrupted."""


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small draws, and a checkpoint at every look."""
    monkeypatch.setattr(pool, "CHUNK", 2**15)
    monkeypatch.setattr(training, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
    monkeypatch.setattr(training, "TRIAL_STEPS", 10)


def glossy(query: Query) -> jax.Array:
    """A lobe about the normal over a coloured floor."""
    lobe = jnp.maximum(half_vector(query.wi, query.wo)[..., 2:], 0.0) ** 20
    return 0.5 * lobe + jnp.array([0.3, 0.1, 0.02])[None]


GLOSSY = jax.jit(glossy)


def task(folder: Path, preset: Preset = TINY, seed: int = 3) -> Task:
    record = {"input": "glossy", "seed": seed, "devices": len(jax.devices())}
    return Task(MODEL, pools_of(GLOSSY), preset, seed, folder / "fit.checkpoint", record)


def smape(evaluate: Callable[[Query], jax.Array]) -> float:
    """Over cosine-distributed pairs, by numpy."""
    wi, wo = square_to_cosine(jax.random.uniform(jax.random.key(9), (2, 4096, 2)))
    p, f = (np.asarray(g(Query(wi, wo)), np.float64) for g in (evaluate, glossy))
    return float(np.mean(2 * np.abs(p - f) / (p + f + 1e-3)))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Trained, Listener]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pool, "CHUNK", 2**15)
        listener = Listener()
        return train(task(tmp_path_factory.mktemp("fit"), NEW_POOLS), None, False, listener), listener


def test_it_learns(undisturbed: tuple[Trained, Listener]):
    trained, _ = undisturbed
    constant = smape(lambda query: jnp.full((*query.wi.shape[:-1], 3), jnp.array([0.35, 0.15, 0.07])))
    assert smape(lambda query: MODEL.eval(trained.params, query)) < 0.4 * constant


def test_it_tells_what_it_does_before_and_while_it_works(undisturbed: tuple[Trained, Listener]):
    trained, listener = undisturbed
    assert listener.lines[0] == "drawing 16,384 training queries"
    assert listener.lines[1].startswith("tiny: 600 steps, 0 M queries, about ")
    assert [step for step, _ in listener.notes] == [200, 224, 424, 448, 600]
    errors = [float(note.rsplit(" ", 1)[1]) for _, note in listener.notes]
    assert errors[-1] < 0.5 * errors[0]
    assert trained.steps == 600
    assert trained.cost["fit_seconds"] > trained.cost["draw_seconds"] > 0
    assert trained.cost["compile_seconds"] > 0


def test_an_interrupted_training_goes_on_with_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, undisturbed: tuple[Trained, Listener]
):
    """By a budget that fixes its steps once, at the start: (8 - 2) s at 10 ms a step, whatever a step takes later."""
    made = task(tmp_path, dataclasses.replace(NEW_POOLS, steps=999))
    set_seconds(monkeypatch, draw=2.0, step=0.01)

    def interrupt(done: int) -> None:
        if done >= 424:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(made, 8.0, False, Listener(interrupt))
    assert safetensors.numpy.load_file(made.checkpoint)["step"] == 424
    set_seconds(monkeypatch, draw=2.0, step=1.0)
    resumed = train(made, 8.0, True, Listener())
    assert resumed.steps == undisturbed[0].steps
    for leaf, expected in zip(jax.tree.leaves(resumed.params), jax.tree.leaves(undisturbed[0].params), strict=True):
        np.testing.assert_array_equal(leaf.view(np.int32), expected.view(np.int32))


def test_a_small_budget_draws_a_small_pool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(pool, "CHUNK", 2**12)
    listener = Listener()
    train(task(tmp_path), 1e-6, False, listener)
    assert listener.lines[0] == "drawing 4,096 training queries"
    assert checkpoint.read_record(tmp_path / "fit.checkpoint")["pool"] == 4096


def set_seconds(monkeypatch: pytest.MonkeyPatch, **seconds: float) -> None:
    """Makes the clock's findings these."""
    monkeypatch.setattr(training, "_prepare", partial(with_seconds, PREPARE, seconds))


def with_seconds(prepare: Callable[..., Any], seconds: dict[str, float], *arguments: Any) -> Any:
    prepared, state = prepare(*arguments)
    return prepared._replace(seconds=prepared.seconds | seconds), state


@pytest.mark.parametrize(("case", "last_good"), [("not a number at the last step of a look", 200), ("too fast", 0)])
def test_a_lost_fit_stops_and_keeps_the_last_good_state(tmp_path: Path, case: str, last_good: int):
    schedules = {
        "not a number at the last step of a look": lambda step, steps: jnp.where(step < 399, 1.0, jnp.nan),
        "too fast": lambda step, steps: jnp.float32(1e4),
    }
    made = task(tmp_path, dataclasses.replace(TINY, schedule=schedules[case]))
    with pytest.raises(FitError, match="the fit diverged before step") as raised:
        train(made, None, False, Listener())
    assert str(raised.value).endswith(f"the last good state is kept in {made.checkpoint}")
    tensors = safetensors.numpy.load_file(made.checkpoint)
    assert tensors["step"] == last_good
    assert all(np.isfinite(tensor).all() for tensor in tensors.values())


@pytest.mark.parametrize(
    ("changes", "error", "fault"),
    [
        ({"seed": 4}, FitError, "was made with seed 4, not 3"),
        ({"input": "matt"}, FitError, "was made with input 'matt', not 'glossy'"),
        ({"devices": 64}, FitError, "was made with devices 64, not 2"),
        ({"steps": "many"}, DataError, "does not say how many steps"),
        ({"steps": None}, DataError, "does not say how many steps"),
        ({"seconds": None}, DataError, "does not say how many steps"),
    ],
)
def test_a_checkpoint_of_another_fit_is_refused(
    tmp_path: Path, changes: dict[str, Any], error: type[JaxbrdfError], fault: str
):
    made = task(tmp_path)
    record = {**made.record, "steps": 600, "seconds": 1.0, **changes}
    tensors = {"step": np.zeros((), np.int32)}
    made.checkpoint.write_bytes(safetensors.numpy.save(tensors, metadata={checkpoint.METADATA_KEY: json.dumps(record)}))
    with pytest.raises(error, match=fault):
        train(made, None, True, Listener())


def test_nothing_to_resume_is_told(tmp_path: Path):
    with pytest.raises(FitError, match=r"fit\.checkpoint: no checkpoint to resume"):
        train(task(tmp_path), None, True, Listener())
