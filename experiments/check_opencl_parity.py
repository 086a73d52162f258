"""How far OpenCL is from JAX: the worst of many demanding queries, for every model, variant and device.

Writes experiments/results/opencl_parity.json.
"""

from __future__ import annotations

import json
from pathlib import Path

import jax

from jaxbrdf import __version__
from jaxbrdf.checks.parity import demanding_params, demanding_queries, jax_values, opencl_parity, with_isotropy
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.export.manifest import Manifest, Provenance
from jaxbrdf.models.table import MODELS
from jaxbrdf.opencl import platform

RESULT = Path(__file__).parent / "results" / "opencl_parity.json"
SEEDS = range(2)


def bundle(model: str, isotropic: bool, precision: str, seed: int) -> Bundle:
    """Random demanding parameters as they come back from a file."""
    entry = MODELS[model]
    config = with_isotropy(entry.config(), isotropic)
    params = demanding_params(jax.random.key(seed), entry.build(config))
    provenance = Provenance("random", "", __version__, seed, "none", 0)
    manifest = Manifest("random", model, config, provenance, {}, {})
    return from_bytes(to_bytes(Bundle(manifest, params), precision=precision), "random")


def worst(model: str, isotropic: bool, precision: str) -> dict[str, float]:
    """Largest violation by device, over all seeds; at most 1 is a pass."""
    found = {platform.describe(device): 0.0 for device in platform.devices()}
    for seed in SEEDS:
        made = bundle(model, isotropic, precision, seed)
        query = demanding_queries(jax.random.key(100 + seed))
        expected = jax_values(made, query)
        for device in platform.devices():
            violation = opencl_parity(made, device, query, expected).violation
            found[platform.describe(device)] = max(found[platform.describe(device)], violation)
    return found


def main() -> None:
    rows = []
    for model in MODELS:
        for isotropic in (True, False):
            for precision in ("float32", "float16"):
                variant = "isotropic" if isotropic else "general"
                rows.append({"model": model, "variant": variant, "storage": precision})
                rows[-1]["violation"] = worst(model, isotropic, precision)
                print(json.dumps(rows[-1]), flush=True)
    queries = len(demanding_queries(jax.random.key(0)).wi) * len(SEEDS)
    bound = "largest |OpenCL - JAX| / (1e-4 f + 1e-6); at most 1 is a pass"
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(json.dumps({"violation": bound, "queries": queries, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
