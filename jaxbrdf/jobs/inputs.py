"""The inputs of a comparison: materials to fit, and bundles to set beside the fits."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.reference import Reference, reference_of
from jaxbrdf.jobs.source import BUNDLE_NAME, Source, bundle_path, open_bundle, open_source


class Given(NamedTuple):
    """A bundle that was given: its name in tables, what is in it, and where it lies."""

    name: str
    bundle: Bundle
    file: Path


class Inputs(NamedTuple):
    """What was given, in its order; no two have one name."""

    references: list[Reference]
    bundles: list[Given]


def open_inputs(names: Sequence[str]) -> Inputs:
    """The inputs that the names stand for.

    Raises:
        JaxbrdfError: if one cannot be read, two would have the same name, or there is nothing to judge the bundles by.
    """
    if len(set(names)) < len(names):
        raise JaxbrdfError(f"{_twice(names)}: is given twice")
    opened = {name: open_source(name) for name in names}
    bundles = [_given(name, source) for name, source in opened.items() if source.bundle is not None]
    references = [reference_of(source) for source in opened.values() if source.bundle is None]
    if not references:
        raise JaxbrdfError(
            f"{names[0]}: is a bundle; to judge it, a measured file or a built-in material is needed too"
        )
    _refuse_twins("materials", [reference.material.name for reference in references])
    _refuse_twins("bundles", [given.name for given in bundles])
    return Inputs(references, bundles)


def given(name: str) -> Given:
    """The bundle of this name, of any material.

    Raises:
        JaxbrdfError: if it is none.
    """
    return _called(name, open_bundle(name, surfaces=True))


def _refuse_twins(kind: str, names: Sequence[str]) -> None:
    if len(set(names)) < len(names):
        raise JaxbrdfError(f"two {kind} are called {_twice(names)}: their results would lie in one place")


def _given(name: str, source: Source) -> Given:
    assert source.bundle is not None
    return _called(name, source.bundle)


def _called(name: str, bundle: Bundle) -> Given:
    """By the name of the folder that a fit wrote, or of the file."""
    file = bundle_path(Path(name))
    return Given(file.resolve().parent.name if file.name == BUNDLE_NAME else file.stem, bundle, file)


def _twice(names: Sequence[str]) -> str:
    return next(name for name in names if names.count(name) > 1)
