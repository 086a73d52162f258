"""Fits the analytic models to measured files by least squares, and compares what they reach with many random starts.

    python experiments/bench_least_squares.py                    # the 12 RGL files: about half an hour on two cores
    python experiments/bench_least_squares.py cg_sunflower       # some of them; writes nothing
    python experiments/bench_least_squares.py --models ggx abc   # some models; writes nothing
    python experiments/bench_least_squares.py --again            # the fits alone, ten minutes; the best of 20 is kept
    python experiments/bench_least_squares.py --again cg_sunflower   # of some; the other rows are kept too

For each file and model: seconds of the fit after compilation, its squared error, and the least that any of 20 random
starts reaches that are all followed to their end; errors of the fit as `jaxbrdf compare` defines them. For each model
the time of an evaluation by OpenCL.
"""

from __future__ import annotations

import argparse
import json
import os
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


def measure(reference: Reference, model: str, pairs: list, restarted: float | None) -> dict[str, Any]:
    """One row.

    Args:
        reference: what is fitted.
        model: a key of `ANALYTIC`.
        pairs: that errors are means over.
        restarted: the least squared error of the random starts, where it is known.
    """
    problem, trained = fit(reference, model)
    evaluate = _evaluate(model, problem.config)
    errors = compare_at(pairs, {"": partial(evaluate, trained.params)})[""]
    least = min(trained.findings["start_costs"])
    return {
        "material": reference.material.name,
        "model": model,
        **seconds(trained),
        "cost": least,
        "over_best_of_20": least / (best_of_restarts(problem) if restarted is None else restarted),
        **{name: float(getattr(errors, name).value) for name in ERRORS},
    }


def best_of_restarts(problem: Problem) -> float:
    """The least squared error that random starts reach, all followed to their end."""
    start = partial(ANALYTIC[problem.model].start, config=problem.config)
    starts = jax.vmap(start)(jax.random.split(jax.random.key(1), RESTARTS))
    residuals = residuals_of(problem.model, problem.config)
    return float(solve(residuals, starts, problem_data(problem), steps=RESTART_STEPS).cost)


def known_restarts() -> dict[tuple[str, str], float]:
    """The least squared error of random starts in the results, by material and model."""
    rows = json.loads(RESULTS.read_text())["rows"]
    return {(row["material"], row["model"]): row["cost"] / row["over_best_of_20"] for row in rows}


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
    parser.add_argument("--again", action="store_true", help="make the fits again, and keep the best of 20 starts")
    options = parser.parse_args()
    folder = Path(os.environ["JAXBRDF_DATA"]) / "rgl"
    names = options.materials or sorted(path.name.removesuffix("_rgb.bsdf") for path in folder.glob("*_rgb.bsdf"))
    known, rows = known_restarts() if options.again else {}, []
    for name in names:
        reference = open_reference(str(folder / f"{name}_rgb.bsdf"))
        pairs = list(true_pairs(jax.random.key(5), reference.evaluate, draw_weighted))
        for model in options.models:
            rows.append(measure(reference, model, pairs, known.get((reference.material.name, model))))
            print(json.dumps(rows[-1]), flush=True)
    if options.again:
        report = json.loads(RESULTS.read_text())
        made = {(row["material"], row["model"]): row for row in rows}
        report["rows"] = [made.get((row["material"], row["model"]), row) for row in report["rows"]]
        RESULTS.write_text(json.dumps(report, indent=1) + "\n")
    elif not options.materials and len(options.models) == len(ANALYTIC):
        RESULTS.write_text(json.dumps({"rows": rows, "opencl": prices()}, indent=1) + "\n")


if __name__ == "__main__":
    main()
