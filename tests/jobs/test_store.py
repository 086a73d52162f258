"""Fits that are there are not fitted again, and others are not taken for them."""

from __future__ import annotations

import dataclasses
import json
from functools import cache, partial
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from jaxbrdf.errors import FitError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.fit.presets import PRESETS
from jaxbrdf.jobs import judge, store, training
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.recipe import Recipe
from jaxbrdf.jobs.reference import Reference, open_reference
from jaxbrdf.jobs.store import Store, clear, obtain
from tests.jobs.tiny import TINY, Listener, hasten_judge, pretend_to_train

CANDIDATE = Candidate("gated")
HALF = dataclasses.replace(CANDIDATE, precision="float16")
RECIPE = Recipe("quick", seed=5, budget_seconds=3.0)


@pytest.fixture(scope="module")
def gold() -> Reference:
    return open_reference("gold")


@pytest.fixture(autouse=True)
def trainings(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    hasten_judge(partial(monkeypatch.setattr, judge))
    return pretend_to_train(partial(monkeypatch.setattr, store))


def store_of(folder: Path, reference: Reference, recipe: Recipe = RECIPE) -> Store:
    return Store(folder, reference, recipe, cache(lambda: judge.draw(reference.material)))


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_fit_is_stored_with_its_errors_and_its_origin(tmp_path: Path, gold: Reference):
    found = obtain(store_of(tmp_path, gold), CANDIDATE, Listener())
    assert names(tmp_path) == ["gated-paper.json", "gated-paper.safetensors"]
    loaded = bundles.load(tmp_path / "gated-paper.safetensors")
    assert loaded.manifest == found.manifest
    assert loaded.manifest.errors["smape"] > 0
    assert loaded.manifest.errors["image_flip"] > 0
    origin = loaded.manifest.provenance
    assert (origin.input, origin.seed, origin.preset, origin.steps) == ("gold", 5, "quick", 7)


def test_what_is_there_is_neither_fitted_nor_judged_again(tmp_path: Path, gold: Reference, trainings: list[str]):
    first = obtain(store_of(tmp_path, gold), CANDIDATE, Listener())
    listener = Listener()
    again = obtain(Store(tmp_path, gold, RECIPE, lambda: pytest.fail("judged")), CANDIDATE, listener)
    assert trainings == ["gated-paper"]
    assert listener.lines == []
    assert again.manifest == first.manifest


def test_a_fit_of_half_the_precision_is_the_same_fit(tmp_path: Path, gold: Reference, trainings: list[str]):
    half = obtain(store_of(tmp_path, gold), HALF, Listener())
    full = obtain(store_of(tmp_path, gold), CANDIDATE, Listener())
    assert trainings == ["gated-paper"]
    assert names(tmp_path) == ["gated-paper-float16.safetensors", "gated-paper.json", "gated-paper.safetensors"]
    sizes = [(tmp_path / name).stat().st_size for name in names(tmp_path) if name.endswith("s")]
    assert sizes[0] < 0.6 * sizes[1]
    for a, b in zip(jax.tree.leaves(half.params), jax.tree.leaves(full.params), strict=True):
        np.testing.assert_array_equal(a, np.float32(np.float16(b)) if b.ndim == 3 else b)
    assert half.manifest.errors != full.manifest.errors


@pytest.mark.parametrize(
    "changes", [{"seed": 6}, {"budget_seconds": 4.0}, {"budget_seconds": None}, {"preset": "standard"}]
)
def test_a_fit_by_another_recipe_is_another(
    tmp_path: Path, gold: Reference, trainings: list[str], changes: dict[str, Any]
):
    for candidate in (CANDIDATE, HALF):
        obtain(store_of(tmp_path, gold), candidate, Listener())
    other = store_of(tmp_path, gold, dataclasses.replace(RECIPE, **changes))
    found = obtain(other, HALF, Listener())
    assert len(trainings) == 2
    assert found.manifest.provenance.seed == other.recipe.seed
    obtain(other, CANDIDATE, Listener())
    assert len(trainings) == 2


def test_a_fit_of_another_material_is_another(tmp_path: Path, gold: Reference, trainings: list[str]):
    obtain(store_of(tmp_path, gold), CANDIDATE, Listener())
    assert obtain(store_of(tmp_path, open_reference("glazed-ceramic")), CANDIDATE, Listener()).manifest.name != "gold"
    assert len(trainings) == 2


@pytest.mark.parametrize("file", ["gated-paper.safetensors", "gated-paper.json"])
@pytest.mark.parametrize("content", [b"", b"hello", b"[1]", None])
def test_a_damaged_file_is_made_again(
    tmp_path: Path, gold: Reference, trainings: list[str], file: str, content: bytes | None
):
    obtain(store_of(tmp_path, gold), CANDIDATE, Listener())
    (tmp_path / file).unlink()
    if content is not None:
        (tmp_path / file).write_bytes(content)
    obtain(store_of(tmp_path, gold), CANDIDATE, Listener())
    assert len(trainings) == 2
    json.loads((tmp_path / "gated-paper.json").read_bytes())


def test_a_fit_that_its_precision_does_not_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, gold: Reference):
    pretended = store.train

    def train(*arguments: Any) -> training.Trained:
        trained = pretended(*arguments)
        return trained._replace(params=jax.tree.map(lambda leaf: leaf * np.float32(1e5), trained.params))

    monkeypatch.setattr(store, "train", train)
    with pytest.raises(FitError, match="beyond the range of float16"):
        obtain(store_of(tmp_path, gold), HALF, Listener())


@pytest.mark.parametrize(("seed", "first_look"), [(1, 400), (2, 200)])
def test_an_interrupted_training_goes_on_but_not_as_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, gold: Reference, seed: int, first_look: int
):
    monkeypatch.setattr(store, "train", training.train)
    monkeypatch.setitem(PRESETS, "tiny", lambda: TINY)
    small = Candidate("nbrdf", (4,))

    def interrupt(done: int) -> None:
        if done >= 200:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        obtain(store_of(tmp_path, gold, Recipe("tiny", seed=1)), small, Listener(interrupt))
    assert names(tmp_path) == ["nbrdf-4.checkpoint"]
    listener = Listener()
    obtain(store_of(tmp_path, gold, Recipe("tiny", seed=seed)), small, listener)
    assert [step for step, _ in listener.notes] == list(range(first_look, TINY.steps + 1, 200))
    assert names(tmp_path) == ["nbrdf-4.json", "nbrdf-4.safetensors"]


def test_clearing_leaves_what_others_put_there(tmp_path: Path, gold: Reference):
    folder = tmp_path / "fits"
    folder.mkdir()
    obtain(store_of(folder, gold), CANDIDATE, Listener())
    (folder / "notes.txt").write_text("mine")
    clear(folder)
    assert names(folder) == ["notes.txt"]
    (folder / "notes.txt").unlink()
    clear(folder)
    assert not folder.exists()
    clear(folder)
