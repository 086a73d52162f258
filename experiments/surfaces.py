"""What the benchmarks of spatially varying models share: crops of texture sets, fits that resume, and references.

All is kept under out/surfaces: a fit's bundle and, while it runs, its checkpoint; a reference by everything that it
depends on but the code, so remove the folder after changing what a reference is made by.
"""

from __future__ import annotations

import os
import pickle
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import jax

from jaxbrdf.data.pbr import PbrTextures, read_folder
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.fit.presets import SURFACE_PRESETS, SurfacePreset
from jaxbrdf.jobs.planar_judge import PlanarReference, planar_reference
from jaxbrdf.jobs.progress import Terminal
from jaxbrdf.jobs.surface import Surface, surface_from
from jaxbrdf.jobs.surface_config import sizes_of
from jaxbrdf.jobs.surface_training import surface_bundle, surface_task
from jaxbrdf.jobs.training import Task, train
from jaxbrdf.render.planar_scene import PlanarScene
from jaxbrdf.surface.textured import reciprocal_mip_mapped, reciprocal_textured
from jaxbrdf.types import Material

OUT = Path("out") / "surfaces"
SETS = ("Metal053C", "fabric_pattern_07", "Bricks102")
JUDGING_SEED, SAMPLES = 20_260_102, 512


def crop(name: str, size: int) -> Surface:
    """The top left of a texture set."""
    textures = read_folder(Path(os.environ["JAXBRDF_DATA"]) / "textures" / name)
    return surface_from(name, PbrTextures(*(part[:size, :size] for part in textures[:4]), textures.told))


def preset_of(steps: int, *, stretched: bool = True) -> SurfacePreset:
    """The quick preset with this many steps, under footprints as slanted views make them or round ones."""
    quick = SURFACE_PRESETS["quick"]()
    return replace(
        quick, training=replace(quick.training, steps=steps), draws=replace(quick.draws, stretched=stretched)
    )


def file_of(surface: Surface, fit: str) -> Path:
    """Where the bundle of a fit is."""
    return OUT / f"{surface.name}-{surface.layout.width}" / f"{fit}.safetensors"


def task_of(surface: Surface, fit: str, model: str, preset: SurfacePreset, sizes: Any = None) -> Task:
    """The training of a fit, at a model's own sizes or others."""
    checkpoint = file_of(surface, fit).with_suffix(".checkpoint")
    return surface_task(model, sizes or sizes_of(model, surface.layout), surface, preset, seed=0, checkpoint=checkpoint)


def fitted(surface: Surface, fit: str, model: str, preset: SurfacePreset, sizes: Any = None) -> Bundle:
    """The bundle of a fit: the one that is there, or a new one, which goes on from its checkpoint."""
    file = file_of(surface, fit)
    if file.exists():
        return bundles.load(file)
    file.parent.mkdir(parents=True, exist_ok=True)
    task = task_of(surface, fit, model, preset, sizes)
    trained = train(task, None, task.checkpoint.exists(), Terminal())
    bundle = surface_bundle(model, sizes or sizes_of(model, surface.layout), surface, task, trained)
    bundles.save(file, bundle)
    task.checkpoint.unlink(missing_ok=True)
    return bundle


def reference_of(surface: Surface) -> PlanarReference:
    """What all fits of a surface are judged by."""
    scene = PlanarScene(max(surface.layout.height, surface.layout.width))
    made_of = sha256(repr((surface.sha256, scene, JUDGING_SEED, SAMPLES)).encode()).hexdigest()[:16]
    file = OUT / f"{surface.name}-{surface.layout.width}" / f"reference-{made_of}.pickle"
    if file.exists():
        return pickle.loads(file.read_bytes())
    material = Material(surface.name, reciprocal_textured(surface.layout), surface.maps.texels, False)
    reference = planar_reference(jax.random.key(JUDGING_SEED), material, scene, samples=SAMPLES)
    reference = jax.device_get(reference)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(pickle.dumps(reference))
    return reference


def mip_maps(surface: Surface) -> Material:
    """The maps' own means, shaded once."""
    return Material("mip maps", reciprocal_mip_mapped(surface.layout), surface.maps.texels, False)
