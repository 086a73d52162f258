"""Fits the analytic models to measured files by least squares, and compares what they reach with many random starts.

    python experiments/bench_least_squares.py                    # the 12 RGL files: about half an hour on two cores
    python experiments/bench_least_squares.py cg_sunflower       # some of them; writes nothing
    python experiments/bench_least_squares.py --models ggx abc   # some models; writes nothing
    python experiments/bench_least_squares.py --seconds          # the fits timed again, for a quiet machine

For each file and model: seconds of the fit after compilation, its squared error, and the least that any of 20 random
starts reaches that are all followed to their end; errors of the fit as `jaxbrdf compare` defines them. For each model
the time of an evaluation by OpenCL.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import jax

from jaxbrdf.fit.least_squares import solve
from jaxbrdf.jobs.candidate import Candidate
from jaxbrdf.jobs.fitting import unfitted
from jaxbrdf.jobs.price import opencl_prices
from jaxbrdf.jobs.progress import Silent
from jaxbrdf.jobs.reference import Reference, open_reference
from jaxbrdf.jobs.solving import Problem, problem_data, residuals_of, solve_for
from jaxbrdf.jobs.training import Trained
from jaxbrdf.metrics.brdf_space import compare_at, true_pairs
from jaxbrdf.models.table import ANALYTIC, brdf_of
from jaxbrdf.opencl.platform import choose, context_of, describe
from jaxbrdf.sampling.pairs import draw_weighted

RESULTS = Path(__file__).parent / "results" / "least_squares.json"
RESTARTS, RESTART_STEPS = 20, 100
ERRORS = ("mae", "smape", "rmse", "log_rmse")


def fit(reference: Reference, model: str) -> tuple[Problem, Trained]:
    """A fit as the command line makes it."""
    problem = Problem(model, ANALYTIC[model].config(isotropic=reference.material.isotropic), reference.evaluate, 0)
    return problem, solve_for(problem, Silent())


def seconds(trained: Trained) -> dict[str, float]:
    return {name: trained.cost[name] for name in ("fit_seconds", "draw_seconds", "compile_seconds")}


def measure(reference: Reference, model: str, pairs: list) -> dict[str, Any]:
    """One row."""
    problem, trained = fit(reference, model)
    start = partial(ANALYTIC[model].start, config=problem.config)
    starts = jax.vmap(start)(jax.random.split(jax.random.key(1), RESTARTS))
    restarted = solve(residuals_of(model, problem.config), starts, problem_data(problem), steps=RESTART_STEPS)
    evaluate = _evaluate(model, problem.config)
    errors = compare_at(pairs, {"": partial(evaluate, trained.params)})[""]
    least = min(trained.findings["start_costs"])
    return {
        "material": reference.material.name,
        "model": model,
        **seconds(trained),
        "cost": least,
        "over_best_of_20": least / float(restarted.cost),
        **{name: float(getattr(errors, name).value) for name in ERRORS},
    }


def time_again(paths: list[Path], models: Sequence[str]) -> None:
    """The seconds of these models' rows of the results, measured anew; the first file compiles."""
    report = json.loads(RESULTS.read_text())
    rows = {(row["material"], row["model"]): row for row in report["rows"]}
    for path in [paths[0], *paths]:
        reference = open_reference(str(path))
        for model in models:
            rows[reference.material.name, model].update(seconds(fit(reference, model)[1]))
        print(reference.material.name, [round(rows[reference.material.name, m]["fit_seconds"], 2) for m in models])
    RESULTS.write_text(json.dumps(report, indent=1) + "\n")


@cache
def _evaluate(model: str, config: Any) -> Any:
    return jax.jit(brdf_of(model, config).eval)


def prices() -> dict[str, Any]:
    """Nanoseconds of an evaluation of each model, isotropic, in the same rounds."""
    context = context_of(choose())
    bundles = {model: unfitted(Candidate(model), isotropic=True) for model in ANALYTIC}
    found = opencl_prices(bundles, context, reporter=Silent())
    return {"device": describe(context.devices[0]), "ns": {model: price.ns for model, price in found.items()}}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("materials", nargs="*")
    parser.add_argument("--models", nargs="+", choices=tuple(ANALYTIC), default=tuple(ANALYTIC))
    parser.add_argument("--seconds", action="store_true", help="time the fits again, and change nothing else")
    options = parser.parse_args()
    folder = Path(os.environ["JAXBRDF_DATA"]) / "rgl"
    names = options.materials or sorted(path.name.removesuffix("_rgb.bsdf") for path in folder.glob("*_rgb.bsdf"))
    if options.seconds:
        return time_again([folder / f"{name}_rgb.bsdf" for name in names], options.models)
    rows = []
    for name in names:
        reference = open_reference(str(folder / f"{name}_rgb.bsdf"))
        pairs = list(true_pairs(jax.random.key(5), reference.evaluate, draw_weighted))
        for model in options.models:
            rows.append(measure(reference, model, pairs))
            print(json.dumps(rows[-1]), flush=True)
    if not options.materials and len(options.models) == len(ANALYTIC):
        RESULTS.write_text(json.dumps({"rows": rows, "opencl": prices()}, indent=1) + "\n")


if __name__ == "__main__":
    main()
