"""Checkpoints: every bit comes back, and nothing else is taken for one."""

from __future__ import annotations

from pathlib import Path

import jax
import numpy as np
import pytest
import safetensors.numpy

from jaxbrdf.errors import DataError
from jaxbrdf.fit import checkpoint, loop
from jaxbrdf.fit.loop import FitState
from jaxbrdf.fit.optimiser import OptimiserConfig, adam
from jaxbrdf.models.table import MODELS

RECORD = {"input": "gold", "steps": 7, "seconds": 1.5}


def state_of(name: str, **sizes: object) -> FitState:
    """The state of a fit with random bits in every number, not-a-numbers left out."""
    model, rng = MODELS[name].build(MODELS[name].config(**sizes)), np.random.default_rng(0)
    shapes = jax.eval_shape(lambda: loop.start(model.init(jax.random.key(0)), adam(OptimiserConfig())))
    return jax.tree.map(lambda leaf: bits(rng, leaf.shape).view(leaf.dtype), shapes)


def bits(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    drawn = np.asarray(rng.integers(-(2**31), 2**31, shape), np.int32)
    return np.where(np.isnan(drawn.view(np.float32)), np.int32(1), drawn)


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "fit.checkpoint"
    checkpoint.save(path, state_of("gated", horizon=True), RECORD)
    return path


@pytest.mark.parametrize("model", MODELS)
def test_every_bit_comes_back(tmp_path: Path, model: str):
    state, path = state_of(model), tmp_path / "fit.checkpoint"
    checkpoint.save(path, state, RECORD)
    found = checkpoint.load(path, like=jax.tree.map(np.zeros_like, state))
    assert jax.tree.structure(found) == jax.tree.structure(state)
    for leaf, expected in zip(jax.tree.leaves(found), jax.tree.leaves(state), strict=True):
        assert leaf.dtype == expected.dtype
        np.testing.assert_array_equal(leaf.view(np.int32), expected.view(np.int32))
    assert checkpoint.read_record(path) == RECORD


def test_one_of_another_model_is_refused(saved: Path):
    with pytest.raises(DataError, match=r"a checkpoint of another model: params\.mlp\.weights\.1"):
        checkpoint.load(saved, like=state_of("gated", horizon=True, hidden=(12, 13)))


@pytest.mark.parametrize("keep", [0, 1, 8, 100, -1])
def test_a_cut_one_is_refused_in_one_line(saved: Path, keep: int):
    saved.write_bytes(saved.read_bytes()[:keep])
    for read in (checkpoint.read_record, lambda path: checkpoint.load(path, like=state_of("gated", horizon=True))):
        with pytest.raises(DataError, match="not a checkpoint") as raised:
            read(saved)
        assert "\n" not in str(raised.value)


@pytest.mark.parametrize("text", ["[]", "{", "1", "null"])
def test_one_without_a_record_is_refused(tmp_path: Path, text: str):
    path = tmp_path / "fit.checkpoint"
    path.write_bytes(safetensors.numpy.save({"a": np.zeros(1)}, metadata={checkpoint.METADATA_KEY: text}))
    with pytest.raises(DataError, match="not a checkpoint"):
        checkpoint.read_record(path)


def test_a_missing_one_and_a_folder_are_refused(tmp_path: Path):
    for path in (tmp_path / "none.checkpoint", tmp_path):
        with pytest.raises(DataError, match="not a checkpoint"):
            checkpoint.read_record(path)
