"""What storing a fitted material in float16 adds to its error: the built-in materials, and measured files if there are.

    python experiments/check_half_storage.py [BUNDLE=INPUT ...]

Fits each built-in material for a few seconds, or takes the given bundles with the inputs they were fitted to. The error
is that of the OpenCL kernels, whose texels are stored in float32 and in float16, on the pairs that judge a fit. Writes
experiments/results/half_storage.json.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from jaxbrdf import cli
from jaxbrdf.brdf import builtin
from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.export.bundle import Bundle, from_bytes, load, to_bytes
from jaxbrdf.jobs import judge
from jaxbrdf.jobs.source import open_source
from jaxbrdf.metrics.brdf_space import compare_at
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.platform import choose, context_of
from jaxbrdf.types import Query

RESULT = Path(__file__).parent / "results" / "half_storage.json"


def evaluated(bundle: Bundle) -> Callable[[Query], np.ndarray]:
    """f as the kernel gives it."""
    material = Material.load(bundle, context_of(choose()))
    return lambda query: material.evaluate(np.asarray(query.wi), np.asarray(query.wo))


def added(name: str, bundle: Bundle, source: str) -> dict[str, Any]:
    """What float16 adds to each error, in per cent of it; negative where it takes away."""
    stored = from_bytes(to_bytes(bundle, precision="float16"), name)
    draws = judge.draw(symmetrised(open_source(source).material))
    errors = compare_at(draws.pairs, {"full": evaluated(bundle), "half": evaluated(stored)})
    full, half = (judge.plain_errors(errors[key]) for key in ("full", "half"))
    return {"material": name, **{key: 100.0 * (half[key] - full[key]) / full[key] for key in ("mae", "smape", "rmse")}}


def fitted(name: str) -> Bundle:
    """A fit of a few seconds."""
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/fit.safetensors"
        if cli.run(["fit", name, "--budget-seconds", "10", "-o", path]):
            raise SystemExit(2)
        return load(path)


def main() -> None:
    given = [argument.partition("=")[::2] for argument in sys.argv[1:]]
    cases = [(Path(source).stem, load(path), source) for path, source in given]
    cases = cases or [(name, fitted(name), name) for name in builtin.MATERIALS]
    rows = [added(*case) for case in cases]
    print(json.dumps(rows, indent=1))
    RESULT.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
