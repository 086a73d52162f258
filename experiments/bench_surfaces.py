"""Fits every spatially varying model to texture sets for the same time, and judges all on the planar scene.

    python -m experiments.bench_surfaces --pace                          # first, on a quiet machine: three minutes
    python -m experiments.bench_surfaces                                 # fits what is missing, and judges: 2.5 h
    python -m experiments.bench_surfaces Rock058 --models gated --fit    # some fits and no judgement

Crops of `--size` texels from the top left, by the recipe of the quick preset. A fit has as many steps as go into
`--seconds` at the pace that `--pace` measured for all models in one interleaved run; so fits may run beside each other,
be stopped and be resumed, and have the same time all the same.

Keeps bundles and references in out/surfaces; writes experiments/results/surface_pace.json and surfaces.json.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from experiments.surfaces import SETS, crop, fitted, mip_maps, preset_of, reference_of, task_of
from jaxbrdf.cli import use_every_core
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs.planar_judge import planar_report
from jaxbrdf.jobs.progress import Silent
from jaxbrdf.jobs.training import step_timer
from jaxbrdf.models.operations import spatial_operations
from jaxbrdf.models.table import SPATIAL

RESULTS = Path(__file__).parent / "results"
PACE = RESULTS / "surface_pace.json"
ROUNDS = 4


def measured_pace(size: int) -> dict[str, Any]:
    """Seconds of a step of every model: medians, and the least and most, of interleaved rounds."""
    surface = crop(SETS[0], size)
    timers = {name: step_timer(task_of(surface, f"{name}-pace", name, preset_of(1)), Silent()) for name in SPATIAL}
    rounds = [{name: timer() for name, timer in timers.items()} for _ in range(ROUNDS)]
    times = {name: [of[name] for of in rounds] for name in SPATIAL}
    return {
        "size": size,
        "devices": len(jax.devices()),
        "seconds": {name: float(np.median(of)) for name, of in times.items()},
        "least_and_most": {name: [min(of), max(of)] for name, of in times.items()},
    }


def steps_in(seconds: float, model: str, size: int) -> int:
    """Steps of a model in this time.

    Raises:
        SystemExit: if no pace has been measured for the size.
    """
    pace = json.loads(PACE.read_text()) if PACE.exists() else {}
    if pace.get("size") != size:
        raise SystemExit(f"{PACE} has no pace for {size} texels: run --pace --size {size} first")
    return int(seconds / pace["seconds"][model])


def judged(name: str, size: int, models: Sequence[str]) -> dict[str, Any]:
    """The planar report of a set's fits, and of plain mip maps."""
    surface = crop(name, size)
    found = {model: fitted(surface, model, model, preset_of(0)) for model in models}
    materials = {model: bundles.material(bundle) for model, bundle in found.items()} | {"mip maps": mip_maps(surface)}
    costs = {
        model: bundle.manifest.cost
        | {"steps": bundle.manifest.provenance.steps}
        | {"operations": spatial_operations(SPATIAL[model].build(bundle.manifest.config)).published}
        for model, bundle in found.items()
    }
    return {"set": name, "cost": costs, **planar_report(materials, reference_of(surface))}


def told(row: dict[str, Any]) -> None:
    for model, of in row["materials"].items():
        (flip, low, high), (coarse, *_) = of["flip"], of["from_two_texels"]["flip"]
        print(f"{row['set']:20} {model:12} FLIP {flip:.4f} ({low:.4f} to {high:.4f}), from 2 texels {coarse:.4f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sets", nargs="*")
    parser.add_argument("--models", nargs="+", choices=tuple(SPATIAL), default=tuple(SPATIAL))
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--seconds", type=float, default=480.0, help="of fitting, for each model")
    parser.add_argument("--pace", action="store_true", help="measure the time of steps, and nothing else")
    parser.add_argument("--fit", action="store_true", help="fit, and judge nothing")
    options = parser.parse_args()
    if options.pace:
        use_every_core()
        PACE.write_text(json.dumps(measured_pace(options.size), indent=1) + "\n")
        return
    sets = options.sets or SETS
    minutes = len(sets) * len(options.models) * options.seconds / 60.0
    print(f"{len(sets)} sets, {len(options.models)} models: {minutes:.0f} minutes of fits, less those that are there")
    for name in sets:
        for model in options.models:
            fitted(crop(name, options.size), model, model, preset_of(steps_in(options.seconds, model, options.size)))
    if options.fit:
        return
    rows = [judged(name, options.size, options.models) for name in sets]
    for row in rows:
        told(row)
    if not options.sets and len(options.models) == len(SPATIAL):
        found = {"size": options.size, "seconds": options.seconds, "rows": rows}
        (RESULTS / "surfaces.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
