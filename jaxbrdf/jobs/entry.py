"""A candidate of a comparison: fitted here or given, and judged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from jaxbrdf.errors import FitError
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.fitting import judged_as_stored
from jaxbrdf.jobs.inputs import Given
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.jobs.reference import Reference
from jaxbrdf.jobs.store import Store, obtain


class Entry(NamedTuple):
    """A judged bundle.

    Attributes:
        input: the name of the material that it was judged by.
        candidate: its own.
        bundle: with its errors.
        file: where it lies.
        is_fitted_here: rather than given.
    """

    input: str
    candidate: str
    bundle: Bundle
    file: Path
    is_fitted_here: bool

    def place_in(self, folder: Path) -> str:
        """The file as seen from a folder that it may lie in."""
        return str(self.file.relative_to(folder) if self.file.is_relative_to(folder) else self.file)


class Failure(NamedTuple):
    """A candidate that could not be fitted, and why."""

    input: str
    candidate: str
    reason: str


def fitted_entries(store: Store, grid: Sequence[Candidate], reporter: Reporter) -> Iterator[Entry | Failure]:
    """The candidates of a grid one after the other, as they are fitted and judged."""
    material = store.reference.material.name
    for place, candidate in enumerate(grid, start=1):
        title = f"{material} {place} of {len(grid)}, {candidate.name}"
        try:
            bundle = obtain(store, candidate, reporter)
        except FitError as error:
            reporter.say(f"{title}: {error}")
            yield Failure(material, candidate.name, str(error))
            continue
        errors = bundle.manifest.errors
        reporter.say(f"{title}: SMAPE {errors['smape']:.4f}, FLIP {errors['image_flip']:.4f}")
        yield Entry(material, candidate.name, bundle, store.file(candidate), True)


def given_entry(given: Given, reference: Reference, draws: judge.Draws) -> Entry | Failure:
    """A bundle that was an input: it may have been fitted to another material, or judged otherwise."""
    material = reference.material.name
    try:
        bundle = judged_as_stored(given.bundle, "float32", draws).bundle
    except FitError as error:
        return Failure(material, given.name, str(error))
    return Entry(material, given.name, bundle, given.file, False)
