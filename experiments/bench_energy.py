"""What it takes to keep a fit from reflecting more light than it gets: its largest albedo, its errors and its time.

    for name in ...; do jaxbrdf fit rgl/${name}_rgb.bsdf -o FOLDER/$name --conserve-energy; done
    python experiments/bench_energy.py FOLDER        # a minute or two

The albedo is summed by another rule than the one that the scale was fitted with, rings about the mirrored viewer
(`jaxbrdf.checks.rings`), at viewers between those of the fit. Both kernels are timed in the same rounds.

Writes experiments/results/energy.json.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from jaxbrdf.checks.rings import albedo_by_rings
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.price import opencl_prices
from jaxbrdf.jobs.progress import Silent
from jaxbrdf.opencl.platform import choose, context_of

RESULTS = Path(__file__).parent / "results" / "energy.json"
ELEVATIONS, TURNS = 61, 5
ERRORS = ("mae", "smape", "rmse", "log_rmse", "image_flip")


def largest_albedo(bundle: Bundle) -> float:
    """Over viewers and channels; elevations crowd towards the horizon."""
    material = bundles.material(bundle)
    cosines = np.linspace(0.07, 1.0, ELEVATIONS) ** 4
    azimuths = [0.37] if material.isotropic else list(0.1 + np.arange(TURNS) * (2.0 * np.pi / TURNS))
    found = []
    for cos in cosines:
        sin = np.sqrt(1.0 - cos * cos)
        for phi in azimuths:
            wo = np.array([sin * np.cos(phi), sin * np.sin(phi), cos])
            found.append(albedo_by_rings(material.brdf.eval, material.params, wo, rings=128, sectors=1024).max())
    return float(max(found))


def measure(folder: Path) -> dict:
    """One material's row."""
    report = json.loads((folder / "bundle.report.json").read_text())
    scaled = bundles.load(folder / "bundle.safetensors")
    plain = scaled._replace(parts=scaled.parts._replace(scale=None))
    before = report["without_energy_scale"] or report["errors"]
    prices = opencl_prices({"without": plain, "with": scaled}, context_of(choose()), reporter=Silent())
    return {
        "material": folder.name,
        "scaled": scaled.parts.scale is not None,
        "albedo_without": largest_albedo(plain),
        "albedo": largest_albedo(scaled),
        **{f"{name}_ratio": report["errors"][name] / before[name] for name in ERRORS},
        "ns_without": prices["without"].ns,
        "ns": prices["with"].ns,
        "seconds": report["cost"]["energy_seconds"],
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
