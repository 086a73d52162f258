"""What each part of the gated model is worth over a surface, and what anisotropic filtering is (docs/filtering.md).

    python -m experiments.bench_surfaces --pace      # first, if not done
    python -m experiments.bench_surface_ablations    # fits what is missing, and judges: an hour

The whole model, without each part, and the three arms of Timonen et al.'s figure 6: trained under round footprints and
read isotropically; trained so, and read anisotropically; both anisotropic, which is the whole model. Every fit has the
steps of the whole model in `--seconds`, so what is cheaper by a part does not get more of them.

Keeps bundles in out/surfaces; writes experiments/results/surface_ablations.json.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

from experiments.bench_surfaces import RESULTS, steps_in, told
from experiments.surfaces import SETS, crop, fitted, mip_maps, preset_of, reference_of
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.planar_judge import planar_report
from jaxbrdf.jobs.surface import Surface
from jaxbrdf.jobs.surface_config import sizes_of
from jaxbrdf.models.operations import spatial_operations
from jaxbrdf.models.table import SPATIAL

Sizes = Any


class Arm(NamedTuple):
    """A variant.

    Attributes:
        title: of its row.
        fit: name of the fit, which arms may share.
        trained: the whole model's sizes to those that are trained.
        stretched: whether it is trained under footprints as slanted views make them.
        read: sizes as trained to those that are judged.
    """

    title: str
    fit: str
    trained: Callable[[Sizes], Sizes] = lambda sizes: sizes
    stretched: bool = True
    read: Callable[[Sizes], Sizes] = lambda sizes: sizes


def isotropic(sizes: Sizes) -> Sizes:
    """Lookups of one probe."""
    return replace(sizes, latents=replace(sizes.latents, probes=1))


ARMS = (
    Arm("whole", "gated"),
    Arm("without gating", "gated-ungated", lambda sizes: replace(sizes, gating=False)),
    Arm("without frame", "gated-unframed", lambda sizes: replace(sizes, frame=False)),
    Arm("without warps", "gated-unwarped", lambda sizes: replace(sizes, warp_terms=0)),
    Arm("trained round, read isotropically", "gated-round", stretched=False, read=isotropic),
    Arm("trained round, read anisotropically", "gated-round", stretched=False),
)


def of_arm(surface: Surface, arm: Arm, steps: int) -> Bundle:
    """Its fit, as it is read."""
    sizes = arm.trained(sizes_of("gated", surface.layout))
    bundle = fitted(surface, arm.fit, "gated", preset_of(steps, stretched=arm.stretched), sizes)
    return bundle._replace(manifest=bundle.manifest._replace(config=arm.read(sizes)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="?", default=SETS[0], help="of the texture set")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--seconds", type=float, default=480.0, help="of fitting the whole model")
    parser.add_argument("--fit", action="store_true", help="fit, and judge nothing")
    options = parser.parse_args()
    surface, steps = crop(options.name, options.size), steps_in(options.seconds, "gated", options.size)
    found = {arm.title: of_arm(surface, arm, steps) for arm in ARMS}
    if options.fit:
        return
    operations = {
        title: spatial_operations(SPATIAL["gated"].build(bundle.manifest.config)).published
        for title, bundle in found.items()
    }
    materials = {title: bundles.material(bundle) for title, bundle in found.items()} | {"mip maps": mip_maps(surface)}
    report = planar_report(materials, reference_of(surface))
    row = {"set": options.name, "seconds": options.seconds, "steps": steps, "operations": operations, **report}
    told(row)
    if options.name == SETS[0]:
        (RESULTS / "surface_ablations.json").write_text(json.dumps(row, indent=1) + "\n")


if __name__ == "__main__":
    main()
