"""What a fit is asked for, and where its results go."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

from jaxbrdf.data.os_fault import os_fault
from jaxbrdf.data.output import check_writable
from jaxbrdf.errors import DataError, JaxbrdfError
from jaxbrdf.fit.presets import PRESETS, Preset
from jaxbrdf.jobs.source import BUNDLE_NAME, BUNDLE_SUFFIX
from jaxbrdf.models.gated import GatedConfig
from jaxbrdf.models.half_difference import TextureSizes
from jaxbrdf.models.table import MODELS
from jaxbrdf.models.tripleplane import TripleplaneConfig


@dataclass(frozen=True)
class FitConfig:
    """A fit as the command line asks for it.

    Attributes:
        source: a measured file or a built-in material.
        output: a folder, or a bundle's file name.
        model: a key of `models.table.MODELS`.
        paper_sizes: the model exactly as its paper has it; otherwise with what we found to help.
        preset: a key of `fit.presets.PRESETS`.
        seed: of every draw.
        budget_seconds: if given, the number of steps is chosen to fit it.
        resume: go on from the checkpoint beside the output.
        precision: of the stored bundle.
    """

    source: str
    output: str
    model: str = "gated"
    paper_sizes: bool = False
    preset: str = "quick"
    seed: int = 0
    budget_seconds: float | None = None
    resume: bool = False
    precision: Literal["float16", "float32"] = "float32"


class FitPaths(NamedTuple):
    """The files of a fit: its result, the report and picture beside it, and the checkpoint while it runs."""

    bundle: Path
    report: Path
    picture: Path
    checkpoint: Path


def preset_of(config: FitConfig) -> Preset:
    """The preset that a config names.

    Raises:
        JaxbrdfError: if there is no such preset or model, or the budget is no time.
    """
    if config.preset not in PRESETS:
        raise JaxbrdfError(f"no preset is called {config.preset!r}; there are {', '.join(PRESETS)}")
    if config.model not in MODELS:
        raise JaxbrdfError(f"no model is called {config.model!r}; there are {', '.join(MODELS)}")
    if config.budget_seconds is not None and not 0 < config.budget_seconds < float("inf"):
        raise JaxbrdfError(f"--budget-seconds is {config.budget_seconds}; it must be a positive number")
    return PRESETS[config.preset]()


def model_config(name: str, *, isotropic: bool, hidden: tuple[int, ...] | None) -> Any:
    """The sizes of a model for a material, without the azimuth that an isotropic one lacks.

    Args:
        name: a key of `models.table.MODELS`.
        isotropic: whether the material is.
        hidden: widths of the gated model's decoder, in our own arrangement of it; None for the paper's sizes.
    """
    textures = TextureSizes(isotropic=isotropic)
    if name == "gated":
        return GatedConfig(textures) if hidden is None else _own_gated(isotropic, hidden)
    if name == "tripleplane":
        return TripleplaneConfig(textures)
    return MODELS[name].config(isotropic=isotropic)


def _own_gated(isotropic: bool, hidden: tuple[int, ...]) -> GatedConfig:
    """The gated model as we fit it: about the paper's memory, otherwise spent.

    Without its azimuth, an isotropic H costs so little that its radius can be four times finer; that pays for two more
    channels and a finer D. The warps start where highlights need them: half of each begins as a near square root, half
    as a power.
    """
    textures = TextureSizes(isotropic, 128 if isotropic else 40, 40, 40, 40, channels=8)
    return GatedConfig(textures, hidden, h_exponents=(0.6, 1.5), d_exponents=(0.7, 2.0), horizon=True)


def output_paths(output: str) -> FitPaths:
    """Where a fit writes: into a folder, or beside the bundle's file."""
    path = Path(output)
    is_file = path.suffix == BUNDLE_SUFFIX
    folder, stem = (path.parent, path.stem) if is_file else (path, "bundle")
    bundle = path if is_file else folder / BUNDLE_NAME
    return FitPaths(bundle, *(folder / f"{stem}{suffix}" for suffix in (".report.json", ".png", ".checkpoint")))


def prepare_output(paths: FitPaths) -> None:
    """Makes the folder and tries to write each file, before any work is done.

    Raises:
        DataError: naming what cannot be written.
    """
    folder = paths.bundle.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise DataError(folder, "is a file, not a folder to write into") from None
    except OSError as error:
        raise DataError(folder, f"cannot be made a folder: {os_fault(error)}") from None
    for file in paths:
        check_writable(file)
