"""Fits every spatially varying model to texture sets for the same time, and judges all on the planar scene.

    python experiments/bench_surfaces.py                          # Metal053C, fabric_pattern_07, Bricks102: 2.5 h
    python experiments/bench_surfaces.py Rock058 --models gated   # some of them; writes nothing but the bundles
    python experiments/bench_surfaces.py --judge                  # judges the bundles that are there again

Crops of `--size` texels from the top left, `--seconds` of fitting for each model (docs/filtering.md). Writes bundles to
out/surfaces and experiments/results/surfaces.json.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

import jax

from jaxbrdf.cli import use_every_core
from jaxbrdf.data.pbr import PbrTextures, read_folder
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.fit.presets import SURFACE_PRESETS
from jaxbrdf.jobs.planar_judge import planar_reference, planar_report
from jaxbrdf.jobs.progress import Terminal
from jaxbrdf.jobs.surface import Surface, surface_from
from jaxbrdf.jobs.surface_config import sizes_of
from jaxbrdf.jobs.surface_training import surface_bundle, surface_task
from jaxbrdf.jobs.training import train
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.render.planar_scene import PlanarScene
from jaxbrdf.surface.textured import reciprocal_mip_mapped, reciprocal_textured
from jaxbrdf.types import Material

RESULTS = Path(__file__).parent / "results" / "surfaces.json"
BUNDLES = Path("out") / "surfaces"
SETS = ("Metal053C", "fabric_pattern_07", "Bricks102")
JUDGING_SEED, SAMPLES = 20_260_102, 512


def crop(name: str, size: int) -> Surface:
    """The top left of a texture set."""
    textures = read_folder(Path(os.environ["JAXBRDF_DATA"]) / "textures" / name)
    return surface_from(name, PbrTextures(*(part[:size, :size] for part in textures[:4]), textures.told))


def fitted(surface: Surface, model: str, seconds: float) -> Bundle:
    """A fit by the quick preset whose steps are chosen to fit the time."""
    sizes, preset = sizes_of(model, surface.layout), SURFACE_PRESETS["quick"]()
    file = bundle_file(surface, model)
    file.parent.mkdir(parents=True, exist_ok=True)
    task = surface_task(model, sizes, surface, preset, seed=0, checkpoint=file.with_suffix(".checkpoint"))
    trained = train(task, seconds, False, Terminal())
    bundle = surface_bundle(model, sizes, surface, task, trained)
    bundles.save(file, bundle)
    task.checkpoint.unlink(missing_ok=True)
    return bundle


def bundle_file(surface: Surface, model: str) -> Path:
    return BUNDLES / f"{surface.name}-{surface.layout.width}" / f"{model}.safetensors"


def judged(surface: Surface, found: dict[str, Bundle]) -> dict[str, Any]:
    """The planar report of all models of a surface, and of plain mip maps."""
    clock = time.perf_counter()
    material = Material(surface.name, reciprocal_textured(surface.layout), surface.maps.texels, False)
    scene = PlanarScene(max(surface.layout.height, surface.layout.width))
    reference = planar_reference(jax.random.key(JUDGING_SEED), material, scene, samples=SAMPLES)
    mip = Material("mip maps", reciprocal_mip_mapped(surface.layout), surface.maps.texels, False)
    materials = {name: bundles.material(bundle) for name, bundle in found.items()} | {"mip maps": mip}
    report = planar_report(materials, reference)
    costs = {name: bundle.manifest.cost | {"steps": bundle.manifest.provenance.steps} for name, bundle in found.items()}
    return {"set": surface.name, "cost": costs, "judge_seconds": time.perf_counter() - clock, **report}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sets", nargs="*")
    parser.add_argument("--models", nargs="+", choices=tuple(SPATIAL), default=tuple(SPATIAL))
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--seconds", type=float, default=480.0, help="of fitting, for each model")
    parser.add_argument("--judge", action="store_true", help="take the bundles that are there")
    options = parser.parse_args()
    use_every_core()
    rows, sets = [], options.sets or SETS
    minutes = len(sets) * len(options.models) * options.seconds / 60.0
    print(
        f"{len(sets)} sets, {len(options.models)} models: about {0 if options.judge else minutes:.0f} minutes of fits"
    )
    for name in sets:
        surface = crop(name, options.size)
        found = {
            model: bundles.load(bundle_file(surface, model))
            if options.judge
            else fitted(surface, model, options.seconds)
            for model in options.models
        }
        rows.append(judged(surface, found))
        for model, of in rows[-1]["materials"].items():
            (flip, low, high), (coarse, *_) = of["flip"], of["from_two_texels"]["flip"]
            print(f"{name:20} {model:12} FLIP {flip:.4f} ({low:.4f} to {high:.4f}), from 2 texels {coarse:.4f}")
    if not options.sets and len(options.models) == len(SPATIAL):
        RESULTS.write_text(
            json.dumps({"size": options.size, "seconds": options.seconds, "rows": rows}, indent=1) + "\n"
        )


if __name__ == "__main__":
    main()
