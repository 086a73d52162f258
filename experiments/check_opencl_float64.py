"""How far the kernels are from float64: ten million random pairs and all hard ones, for each model, variant and device.

    python experiments/check_opencl_float64.py            # about six minutes a device

The reference is JAX in float64 on the same float32 directions. Writes experiments/results/opencl_float64.json, with the
largest |OpenCL - JAX| / (1e-4 f + 1e-6) of each; at most 1 is a pass.
"""

from __future__ import annotations

import dataclasses
import json
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf import __version__
from jaxbrdf.checks.parity import ABSOLUTE, RELATIVE, demanding_params, demanding_queries, with_isotropy
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.export.manifest import Manifest, Provenance, build_brdf
from jaxbrdf.models.table import MODELS
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.platform import context_of, describe, devices
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Query

RESULT = Path(__file__).parent / "results" / "opencl_float64.json"
CHUNK = 2**18
CHUNKS = 39
"""Of random pairs: ten million."""


def variants(model: str) -> dict[str, Any]:
    """The configurations of a model at the paper's sizes."""
    config = MODELS[model].config()
    found = {name: with_isotropy(config, name == "isotropic") for name in ("isotropic", "general")}
    if model == "gated":
        found["general with horizon"] = dataclasses.replace(found["general"], horizon=True)
    return found


def bundle(model: str, config: Any) -> Bundle:
    """Random demanding parameters as they come back from a file."""
    params = demanding_params(jax.random.key(0), MODELS[model].build(config))
    manifest = Manifest("random", model, config, Provenance("random", "", __version__, 0, "none", 0), {}, {})
    return from_bytes(to_bytes(Bundle(manifest, params)), "random")


def random_pairs(key: jax.Array) -> Query:
    """Cosine-distributed pairs, rounded to float32."""
    u = jax.random.uniform(key, (2, CHUNK, 2), jnp.float32)
    return Query(square_to_cosine(u[0]), square_to_cosine(u[1]))


def compiled_reference(made: Bundle) -> Any:
    """f in float64 of directions given in float32."""
    params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), made.params)
    evaluate = jax.jit(partial(build_brdf(made.manifest).eval, params))
    return lambda wi, wo: np.asarray(evaluate(Query(jnp.asarray(wi, jnp.float64), jnp.asarray(wo, jnp.float64))))


def worst(made: Bundle) -> dict[str, dict[str, float]]:
    """Largest violation by device, and how many values are not finite."""
    reference = compiled_reference(made)
    loaded = {describe(device): Material.load(made, context_of(device)) for device in devices()}
    found = {name: {"violation": 0.0, "not_finite": 0} for name in loaded}
    queries = [demanding_queries(jax.random.key(1)), *(random_pairs(jax.random.key(2 + i)) for i in range(CHUNKS))]
    for query in queries:
        wi, wo = (np.asarray(w, np.float32) for w in query[:2])
        expected = reference(wi, wo)
        for name, material in loaded.items():
            f = material.evaluate(wi, wo)
            violation = float(np.nan_to_num(np.abs(f - expected) / (RELATIVE * expected + ABSOLUTE), nan=np.inf).max())
            found[name]["violation"] = max(found[name]["violation"], round(violation, 4))
            found[name]["not_finite"] += int((~np.isfinite(f)).sum())
    return found


def main() -> None:
    jax.config.update("jax_enable_x64", True)
    rows = []
    for model in MODELS:
        for variant, config in variants(model).items():
            rows.append({"model": model, "variant": variant, "devices": worst(bundle(model, config))})
            print(json.dumps(rows[-1]), flush=True)
    RESULT.write_text(json.dumps({"random_pairs": CHUNK * CHUNKS, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
