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
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxbrdf import cli
from jaxbrdf.brdf import builtin
from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.export.bundle import Bundle, from_bytes, load, to_bytes
from jaxbrdf.jobs.source import open_source
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.platform import choose, context_of
from jaxbrdf.sampling.pairs import draw_weighted

RESULT = Path(__file__).parent / "results" / "half_storage.json"
PAIRS = 2**21
SMAPE_OFFSET = 1e-3


def errors(bundle: Bundle, truth: np.ndarray, query: Any, importance: np.ndarray) -> dict[str, float]:
    """MAE, SMAPE and RMSE of the kernel's values, as docs/conventions.md defines them."""
    material = Material.load(bundle, context_of(choose()))
    f = material.evaluate(np.asarray(query.wi), np.asarray(query.wo)).astype(np.float64)
    difference = np.abs(f - truth)
    relative = 2.0 * difference / (f + truth + SMAPE_OFFSET)

    def mean(values: np.ndarray) -> float:
        return float(np.mean(importance[:, None] * values))

    return {"mae": mean(difference), "smape": mean(relative), "rmse": float(np.sqrt(mean(difference**2)))}


def added(name: str, bundle: Bundle, source: str) -> dict[str, Any]:
    """What float16 adds to each error, in per cent of it; negative where it takes away."""
    query, importance = draw_weighted(jax.random.key(20_260_101), PAIRS)
    material = symmetrised(open_source(source).material)
    evaluate = jax.jit(partial(material.brdf.eval, material.params))
    parts = [slice(i, i + 2**18) for i in range(0, PAIRS, 2**18)]
    truth = np.concatenate([np.asarray(evaluate(query._replace(wi=query.wi[p], wo=query.wo[p]))) for p in parts])
    weights = np.asarray(importance, np.float64)
    full = errors(bundle, truth.astype(np.float64), query, weights)
    stored = from_bytes(to_bytes(bundle, precision="float16"), name)
    half = errors(stored, truth.astype(np.float64), query, weights)
    return {"material": name, **{key: 100.0 * (half[key] - full[key]) / full[key] for key in full}}


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
