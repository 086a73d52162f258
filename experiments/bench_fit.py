"""Fits measured files by one preset each and compares every fit with the published network of the same material.

    python experiments/bench_fit.py --preset quick                    # the 12 RGL files: about 20 minutes on two cores
    python experiments/bench_fit.py --preset standard cg_sunflower    # some of them: about 6 minutes each

Runs the command line in a process of its own for each file, so that memory and compilation are what a user sees. Rows
go to experiments/results/bench_fit_PRESET.json as they come; a row that is there is not measured again unless --again
is given.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

RESULTS = Path(__file__).parent / "results"
ERRORS = ("mae", "smape", "rmse", "log_rmse")


def run(*command: str) -> tuple[dict, float]:
    """A command's JSON and its peak memory in GB."""
    with subprocess.Popen([sys.executable, "-m", "jaxbrdf.cli", *command, "--json"], stdout=subprocess.PIPE) as process:
        output = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(command)} failed")
    return json.loads(output), usage.ru_maxrss * resource.getpagesize() / 4096 / 2**20


def measure(data: Path, material: str, preset: str, options: list[str]) -> dict:
    """One row: the fit's errors, their ratios to the published network's, and what it cost."""
    source = str(data / "rgl" / f"{material}_rgb.bsdf")
    network = str(data / "nbrdf" / "rgl-isotropic_nbrdf.zip" / f"{material}_rgb.h5")
    with tempfile.TemporaryDirectory() as folder:
        fit, memory = run("fit", source, "-o", folder, "--preset", preset, *options)
        comparison, _ = run("compare", folder, source, "--against", network)
    ours, theirs, cost = comparison["bundle"], comparison["against"], fit["cost"]
    row = {"material": material, "preset": preset}
    row |= {f"{name}_ratio": comparison["ratio"][name] for name in ERRORS}
    row |= {name: ours[name] for name in ERRORS}
    row |= {f"{name}_standard_error": ours[f"{name}_standard_error"] for name in ERRORS}
    row |= {f"published_{name}": theirs[name] for name in ERRORS}
    row |= {"flip": ours["image_flip"], "published_flip": theirs["image_flip"]}
    row |= {name: cost[name] for name in ("fit_seconds", "compile_seconds", "queries_per_second")}
    return row | {"peak_memory_gb": memory}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("materials", nargs="*")
    parser.add_argument("--preset", default="quick")
    parser.add_argument("--name", help="of the results file, by default the preset's")
    parser.add_argument("--again", action="store_true", help="measure rows that are there already")
    parser.add_argument("--options", default="", help="further options of `jaxbrdf fit`")
    arguments = parser.parse_args()
    data = Path(os.environ["JAXBRDF_DATA"])
    materials = arguments.materials or sorted(p.name.removesuffix("_rgb.bsdf") for p in (data / "rgl").glob("*.bsdf"))
    path = RESULTS / f"bench_fit_{arguments.name or arguments.preset}.json"
    rows = {row["material"]: row for row in json.loads(path.read_text())} if path.exists() else {}
    for material in materials:
        if material in rows and not arguments.again:
            continue
        rows[material] = measure(data, material, arguments.preset, arguments.options.split())
        path.write_text(json.dumps([rows[name] for name in sorted(rows)], indent=1) + "\n")
        shown = {k: round(v, 4) for k, v in rows[material].items() if isinstance(v, float)}
        print(material, {k: shown[k] for k in shown if "ratio" in k or "seconds" in k or "memory" in k}, flush=True)


if __name__ == "__main__":
    main()
