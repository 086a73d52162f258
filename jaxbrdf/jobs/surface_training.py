"""The training of a spatially varying model on a surface."""

from __future__ import annotations

import os
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jax

from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.manifest import Manifest, Provenance
from jaxbrdf.fit.first_params import params_from_maps
from jaxbrdf.fit.presets import SurfacePreset
from jaxbrdf.jobs.supply import draws_of
from jaxbrdf.jobs.surface import Surface
from jaxbrdf.jobs.training import Task, Trained
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.surface.textured import CHANNELS
from jaxbrdf.types import Params

COPIES = 12
"""Of all parameters while a fit runs on one device: the state of training, four of them, before and after a stride and
once more in a trial; a gradient, its sum and the updates made of it are freed in between."""

SPARE = 0.6e9
"""Bytes of the program itself, its compiler, and a batch."""


def surface_task(
    model: str, sizes: Any, surface: Surface, preset: SurfacePreset, *, seed: int, checkpoint: Path
) -> Task:
    """What is to be trained, with its running state in `checkpoint`.

    Args:
        model: a key of `models.table.SPATIAL`.
        sizes: its config, over the surface's layout.
        surface: the reference.
        preset: the recipe.
        seed: of parameters and draws.
        checkpoint: a file.

    Raises:
        JaxbrdfError: if the machine has not the memory.
    """
    built = SPATIAL[model].build(sizes)
    check_memory(built.init, surface)
    init = partial(_guided, built.init, surface) if preset.guided else built.init
    record = {"input": surface.sha256, "model": repr(sizes), "preset": preset.training.name, "seed": seed}
    return Task(
        built,
        draws_of(surface.maps, preset.draws),
        preset.training,
        seed,
        checkpoint,
        {**record, "devices": len(jax.devices())},
        init,
    )


def surface_bundle(model: str, sizes: Any, surface: Surface, task: Task, trained: Trained) -> Bundle:
    """The result of a training with where it comes from; not judged yet."""
    provenance = Provenance(
        surface.name, surface.sha256, version("jaxbrdf"), task.seed, task.preset.name, trained.steps
    )
    manifest = Manifest(surface.name, SPATIAL[model].bundle, sizes, provenance, errors={}, cost=trained.cost)
    return Bundle(manifest, trained.params)


def memory_of(init: Any, surface: Surface) -> float:
    """Bytes that a fit takes at most: `COPIES` of its parameters and one of the maps on every device, and `SPARE`.

    Args:
        init: the model's.
        surface: the reference.
    """
    params = jax.eval_shape(init, jax.random.key(0))
    numbers = sum(leaf.size for leaf in jax.tree.leaves(params))
    return 4.0 * len(jax.devices()) * (COPIES * numbers + CHANNELS * surface.layout.texels) + SPARE


def check_memory(init: Any, surface: Surface) -> None:
    """Refuses a fit that this machine's memory does not hold, before it begins.

    Raises:
        JaxbrdfError: with what it needs and what there is.
    """
    needed, there = memory_of(init, surface), os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed > there:
        height, width = surface.layout.height, surface.layout.width
        raise JaxbrdfError(
            f"a fit of {height} x {width} texels takes up to {needed / 1e9:.1f} GB of memory; "
            f"this machine has {there / 1e9:.1f} GB: take a smaller --size"
        )


def _guided(init: Any, surface: Surface, key: jax.Array) -> Params:
    return params_from_maps(init(key), surface.maps)
