"""How far OpenCL is from JAX: the worst of many demanding queries, for every model, variant and device.

Writes experiments/results/opencl_parity.json.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import jax

from jaxbrdf import __version__
from jaxbrdf.checks.parity import demanding_params, demanding_queries, jax_values, opencl_parity, with_isotropy
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.export.manifest import Manifest, Provenance
from jaxbrdf.models.table import MODELS
from jaxbrdf.opencl import platform

RESULT = Path(__file__).parent / "results" / "opencl_parity.json"
SEEDS = range(2)
Precision = Literal["float32", "float16"]
PRECISIONS: tuple[Precision, ...] = ("float32", "float16")


def variants(model: str) -> dict[str, Any]:
    """The configurations of a model at the paper's sizes."""
    config = MODELS[model].config()
    found = {name: with_isotropy(config, name == "isotropic") for name in ("isotropic", "general")}
    if model == "gated":
        found["general with horizon"] = dataclasses.replace(found["general"], horizon=True)
    return found


def bundle(model: str, config: Any, precision: Precision, seed: int) -> Bundle:
    """Random demanding parameters as they come back from a file."""
    params = demanding_params(jax.random.key(seed), MODELS[model].build(config))
    provenance = Provenance("random", "", __version__, seed, "none", 0)
    manifest = Manifest("random", model, config, provenance, {}, {})
    return from_bytes(to_bytes(Bundle(manifest, params), precision=precision), "random")


def worst(model: str, config: Any, precision: Precision) -> dict[str, float]:
    """Largest violation by device, over all seeds; at most 1 is a pass."""
    found = {platform.describe(device): 0.0 for device in platform.devices()}
    for seed in SEEDS:
        made = bundle(model, config, precision, seed)
        query = demanding_queries(jax.random.key(100 + seed))
        expected = jax_values(made, query)
        for device in platform.devices():
            violation = opencl_parity(made, device, query, expected).violation
            found[platform.describe(device)] = max(found[platform.describe(device)], round(violation, 4))
    return found


def rows() -> Iterator[dict[str, Any]]:
    """One for each model, variant and precision of storage."""
    for model in MODELS:
        for variant, config in variants(model).items():
            for precision in PRECISIONS:
                named = {"model": model, "variant": variant, "storage": precision}
                yield named | {"violation": worst(model, config, precision)}


def main() -> None:
    table = []
    for row in rows():
        print(json.dumps(row), flush=True)
        table.append(row)
    queries = len(demanding_queries(jax.random.key(0)).wi) * len(SEEDS)
    bound = "largest |OpenCL - JAX| / (1e-4 f + 1e-6); at most 1 is a pass"
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(json.dumps({"violation": bound, "queries": queries, "rows": table}, indent=1) + "\n")


if __name__ == "__main__":
    main()
