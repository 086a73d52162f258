"""Finished fits in a folder, which are not fitted again: what makes a long command one that can be stopped."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import DataError, FitError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.json_record import to_plain
from jaxbrdf.fit import checkpoint
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.fitting import bundle_of, judged_as_stored, solved, task_of
from jaxbrdf.jobs.judge import Draws
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.recipe import Recipe
from jaxbrdf.jobs.reference import Reference
from jaxbrdf.jobs.training import Task, train

SUFFIXES = (".safetensors", ".json", ".checkpoint")
"""Of a candidate's bundle, of the record of its training, and of its running state."""


class Store(NamedTuple):
    """The fits of one material by one recipe.

    Attributes:
        folder: of its files.
        reference: what is fitted.
        recipe: of every fit.
        draws: that judge the fits; called when there is one to judge.
    """

    folder: Path
    reference: Reference
    recipe: Recipe
    draws: Callable[[], Draws]

    def file(self, candidate: Candidate, *, suffix: str = SUFFIXES[0]) -> Path:
        """One of a candidate's files, of one of `SUFFIXES`."""
        return self.folder / f"{candidate.slug}{suffix}"


def obtain(store: Store, candidate: Candidate, reporter: Reporter) -> Bundle:
    """The candidate's bundle with its errors: the one that is there, or a new one.

    A training is shared by all precisions of its result. One that was interrupted goes on where it was.

    Raises:
        FitError: if the training diverges, or the precision does not hold its result.
        DataError: if a file cannot be written.
    """
    trained = _trained(store, candidate.trained, reporter)
    path = store.file(candidate)
    kept = _read_bundle(path)
    if kept is not None and kept.manifest.errors:
        return kept
    reporter.say(f"judging {candidate.name}")
    bundle = judged_as_stored(trained, candidate.precision, store.draws()).bundle
    bundles.save(path, bundle, precision=candidate.precision)
    return bundle


def clear(folder: Path) -> None:
    """Removes the files of a store, and the folder if nothing else is in it."""
    if folder.is_dir():
        for path in folder.iterdir():
            if path.suffix in SUFFIXES:
                path.unlink()
        if not any(folder.iterdir()):
            folder.rmdir()


def _trained(store: Store, candidate: Candidate, reporter: Reporter) -> Bundle:
    """The result of a training, in float32."""
    kept = _kept(store, candidate)
    if kept is not None:
        return kept
    for stale in (candidate, replace(candidate, precision="float16")):
        store.file(stale).unlink(missing_ok=True)
    reporter.say(f"fitting {candidate.name}")
    running = store.file(candidate, suffix=".checkpoint")
    if candidate.is_analytic:
        trained = solved(candidate, store.reference, store.recipe, reporter)
    else:
        task = task_of(candidate, store.reference, store.recipe, running)
        task = replace(task, record={**task.record, "budget_seconds": store.recipe.budget_seconds})
        trained = train(task, store.recipe.budget_seconds, _goes_on(task), reporter)
    bundle = bundle_of(candidate, store.reference, store.recipe, trained)
    try:
        bundles.save(store.file(candidate), bundle)
    except ValueError as error:
        raise FitError(f"{candidate.name}: {error}") from None
    write_atomically(store.file(candidate, suffix=".json"), json.dumps(_record(store, candidate), indent=1).encode())
    running.unlink(missing_ok=True)
    return bundles.load(store.file(candidate))


def _kept(store: Store, candidate: Candidate) -> Bundle | None:
    """The training that is there, if it is the one that is wanted."""
    record = read_record(store.file(candidate, suffix=".json"))
    return _read_bundle(store.file(candidate)) if record == _record(store, candidate) else None


def _record(store: Store, candidate: Candidate) -> dict[str, Any]:
    """All that decides what a training ends in."""
    sizes = to_plain(candidate.sizes(isotropic=store.reference.material.isotropic))
    what = {"input": store.reference.identity, "model": candidate.model, "config": sizes}
    return {**what, **asdict(store.recipe), "version": version("jaxbrdf")}


def _goes_on(task: Task) -> bool:
    """Whether the checkpoint is one of this training."""
    if not task.checkpoint.exists():
        return False
    try:
        record = checkpoint.read_record(task.checkpoint)
    except DataError:
        return False
    return task.record.items() <= record.items()


def _read_bundle(path: Path) -> Bundle | None:
    try:
        return bundles.load(path)
    except DataError:
        return None


def read_record(path: Path) -> Any:
    """What a record beside a bundle says; None where there is none that can be read."""
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError):
        return None
