"""Fits measured files by one preset each and compares every fit with the published network of the same material.

    python experiments/bench_fit.py --preset quick                    # the 12 RGL files: about 20 minutes on two cores
    python experiments/bench_fit.py --preset standard cg_sunflower    # some of them: about 3 minutes each

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
COSTS = (
    "fit_seconds",
    "draw_seconds",
    "compile_seconds",
    "queries_per_second",
    "jax_ns_per_evaluation",
    "opencl_ns_per_evaluation",
)


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
    source = data / "rgl" / f"{material}_rgb.bsdf"
    with tempfile.TemporaryDirectory() as folder:
        fit, memory = run("fit", str(source), "-o", folder, "--preset", preset, *options)
        theirs = published(data, source, folder)
        size = (Path(folder) / "bundle.safetensors").stat().st_size
    ours, cost = fit["errors"], fit["cost"]
    row = {"material": material, "preset": preset}
    row |= {f"{name}_ratio": ours[name] / theirs[name] for name in ERRORS}
    row |= {name: ours[name] for name in ERRORS}
    row |= {f"{name}_standard_error": ours[f"{name}_standard_error"] for name in ERRORS}
    row |= {f"published_{name}": theirs[name] for name in ERRORS}
    row |= {"flip": ours["image_flip"], "published_flip": theirs["image_flip"]}
    row |= {name: cost[name] for name in COSTS if name in cost}
    return row | {"peak_memory_gb": memory, "bytes": size}


def published(data: Path, source: Path, bundle: str) -> dict:
    """Errors of the published network of a file, by the draws that judge every fit: measured once, then kept."""
    path = RESULTS / "published_networks.json"
    known = json.loads(path.read_text()) if path.exists() else {}
    if source.name not in known:
        network = data / "nbrdf" / "rgl-isotropic_nbrdf.zip" / f"{source.stem}.h5"
        comparison, _ = run("compare", bundle, str(source), "--against", str(network))
        known[source.name] = comparison["against"]
        path.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n")
    return known[source.name]


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
