"""What it takes to keep a fit from reflecting more light than it gets: its largest albedo, its errors and its time.

    for name in ...; do jaxbrdf fit rgl/${name}_rgb.bsdf -o FOLDER/$name; done
    python experiments/bench_energy.py FOLDER        # half a minute each

Each fit's scale is made anew, and both are judged on the same draws. The albedo is summed by another rule than the one
that the scale was fitted with, rings about the mirrored viewer (`jaxbrdf.checks.rings`), at viewers between those of
the fit. Both kernels are timed in the same rounds.

The measurements themselves return more than one near the horizon, and what conserves energy cannot follow them there:
its MAE is at least the mean of max(albedo - 1, 0) / pi over cosine-distributed viewers, `least_mae`.

Writes experiments/results/energy.json.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

import numpy as np

from jaxbrdf.brdf.albedo_table import tabulate_albedo
from jaxbrdf.checks.rings import albedo_by_rings
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.finishing import with_energy_scale
from jaxbrdf.jobs.fitting import judged_as_stored
from jaxbrdf.jobs.price import opencl_prices
from jaxbrdf.jobs.progress import Silent
from jaxbrdf.jobs.reference import open_reference
from jaxbrdf.opencl.platform import choose, context_of
from jaxbrdf.types import Material

RESULTS = Path(__file__).parent / "results" / "energy.json"
ELEVATIONS, TURNS = 61, 5
GRAZING = 2.0**-6
"""Fourth root of the least cosine that is told from the horizon's."""

TRUTH_ELEVATIONS = 257
ERRORS = ("mae", "smape", "rmse", "log_rmse", "image_flip")


def largest_albedo(bundle: Bundle) -> float:
    """Over viewers and channels; elevations crowd towards the horizon."""
    material = bundles.material(bundle)
    cosines = np.linspace(GRAZING, 1.0, ELEVATIONS) ** 4
    azimuths = [0.37] if material.isotropic else list(0.1 + np.arange(TURNS) * (2.0 * np.pi / TURNS))
    found = []
    for cos in cosines:
        sin = np.sqrt(1.0 - cos * cos)
        for phi in azimuths:
            wo = np.array([sin * np.cos(phi), sin * np.sin(phi), cos])
            found.append(albedo_by_rings(material.brdf.eval, material.params, wo, rings=128, sectors=1024).max())
    return float(max(found))


def least_mae(truth: Material) -> float:
    """Of whatever conserves energy, against the reciprocal part of a measurement that does not."""
    table = tabulate_albedo(truth.brdf.eval, truth.params, isotropic=True, elevations=TRUTH_ELEVATIONS)
    excess = np.maximum(np.asarray(table.values, float)[0] - 1.0, 0.0).mean(axis=-1)
    # cosine-distributed viewers are even in cos^2 = (1 - t)^8
    even = (1.0 - np.linspace(0.0, 1.0, TRUTH_ELEVATIONS)) ** 8
    return float(-np.trapezoid(excess, even) / np.pi)


def measure(folder: Path) -> dict:
    """One material's row."""
    reference = open_reference(str(Path(os.environ["JAXBRDF_DATA"]) / "rgl" / f"{folder.name}_rgb.bsdf"))
    draws, stored = judge.draw(reference.material), bundles.load(folder / "bundle.safetensors")
    plain = judged_as_stored(stored._replace(parts=stored.parts._replace(scale=None)), "float32", draws).bundle
    scaled = judged_as_stored(with_energy_scale(plain, Silent()), "float32", draws).bundle
    before, after = plain.manifest.errors, scaled.manifest.errors
    prices = opencl_prices({"without": plain, "with": scaled}, context_of(choose()), reporter=Silent())
    return {
        "material": folder.name,
        "scaled": scaled.parts.scale is not None,
        "albedo_without": largest_albedo(plain),
        "albedo": largest_albedo(scaled),
        **{f"{name}_ratio": after[name] / before[name] for name in ERRORS},
        "least_mae_ratio": least_mae(reference.material) / before["mae"],
        "ns_without": prices["without"].ns,
        "ns": prices["with"].ns,
        "seconds": scaled.manifest.cost["energy_seconds"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="of fits, one folder each")
    parser.add_argument("-o", "--output", type=Path, default=RESULTS)
    arguments = parser.parse_args()
    rows = []
    for path in sorted(arguments.folder.glob("*/bundle.safetensors")):
        rows.append(measure(path.parent))
        print(json.dumps(rows[-1]), flush=True)
    arguments.output.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
