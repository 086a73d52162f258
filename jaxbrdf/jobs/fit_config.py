"""What a fit is asked for, and where its results go."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from jaxbrdf.data.output import check_writable
from jaxbrdf.export.bundle import Precision
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.folder import make_folder
from jaxbrdf.jobs.recipe import Recipe, preset_of
from jaxbrdf.jobs.source import BUNDLE_NAME, BUNDLE_SUFFIX


@dataclass(frozen=True)
class FitConfig:
    """A fit as the command line asks for it.

    Attributes:
        source: a measured file or a built-in material.
        output: a folder, or a bundle's file name.
        model: one of `models.table.NAMES`.
        paper_sizes: the model exactly as its paper has it; otherwise with what we found to help.
        preset: a key of `fit.presets.PRESETS`.
        seed: of every draw.
        budget_seconds: if given, the number of steps is chosen to fit it.
        resume: go on from the checkpoint beside the output.
        precision: of the stored bundle.
        conserve_energy: end in a bundle whose albedo is at most one.
        sampler: store a sampler with the bundle.
    """

    source: str
    output: str
    model: str = "gated"
    paper_sizes: bool = False
    preset: str = "quick"
    seed: int = 0
    budget_seconds: float | None = None
    resume: bool = False
    precision: Precision = "float32"
    conserve_energy: bool = False
    sampler: bool = True

    @property
    def recipe(self) -> Recipe:
        """How it is trained."""
        return Recipe(self.preset, self.seed, self.budget_seconds)

    @property
    def candidate(self) -> Candidate:
        """What is fitted: the gated model in our own arrangement, the others as their papers have them.

        Raises:
            JaxbrdfError: if there is no such model or preset.
        """
        preset = preset_of(self.recipe)
        own = self.model == "gated" and not self.paper_sizes
        return Candidate(self.model, preset.hidden if own else None, precision=self.precision)


class FitPaths(NamedTuple):
    """The files of a fit: its result, report, picture and map of residuals, and the checkpoint while it runs."""

    bundle: Path
    report: Path
    picture: Path
    residuals: Path
    checkpoint: Path


def output_paths(output: str) -> FitPaths:
    """Where a fit writes: into a folder, or beside the bundle's file."""
    path = Path(output)
    is_file = path.suffix == BUNDLE_SUFFIX
    folder, stem = (path.parent, path.stem) if is_file else (path, "bundle")
    bundle = path if is_file else folder / BUNDLE_NAME
    suffixes = (".report.json", ".png", ".residuals.png", ".checkpoint")
    return FitPaths(bundle, *(folder / f"{stem}{suffix}" for suffix in suffixes))


class SurfacePaths(NamedTuple):
    """The files of a surface's fit: its result, report and picture, and the checkpoint while it runs."""

    bundle: Path
    report: Path
    picture: Path
    checkpoint: Path


def surface_paths(output: str) -> SurfacePaths:
    """Where a surface's fit writes, as `output_paths`."""
    paths = output_paths(output)
    return SurfacePaths(paths.bundle, paths.report, paths.picture, paths.checkpoint)


def prepare_output(paths: FitPaths | SurfacePaths) -> None:
    """Makes the folder and tries to write each file, before any work is done.

    Raises:
        DataError: naming what cannot be written.
    """
    make_folder(paths.bundle.parent)
    for file in paths:
        check_writable(file)
