"""What a frame of a material over a surface costs: OpenCL on the default device and jitted JAX, interleaved in one run.

    python experiments/bench_spatial_opencl.py            # about two minutes

The model is the gated one over a surface at the paper's sizes, 1024 x 1024 latents of eight channels with all their
levels, its parameters random: what it costs does not depend on them. A frame is 1920 x 1080 queries at random places,
under footprints of all scales as training draws them, read with up to 16 probes; neighbours have nothing in common,
unlike those of a picture. `opencl_points` are the same places without filtering. Texels are float16, but for
`opencl_float32`. Times are medians over rounds with their quartiles, a ratio is the median of the rounds' own, and a
round counts the best of three runs. Writes experiments/results/spatial_opencl.json.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxbrdf.checks.parity import random_params
from jaxbrdf.export.bundle import Bundle, from_bytes, to_bytes
from jaxbrdf.export.bundle import material as jax_material
from jaxbrdf.export.manifest import Manifest, Provenance
from jaxbrdf.jobs.price import interleaved, opencl_run
from jaxbrdf.models.spatial_gated import SpatialGatedConfig, spatial_gated
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.platform import choose, context_of, describe
from jaxbrdf.sampling.footprints import draw_places
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.texture.footprint import probes_of
from jaxbrdf.types import Query

RESULT = Path(__file__).parent / "results" / "spatial_opencl.json"
FRAME = 1920 * 1080
ROUNDS = 3
BATCH = 2**16
"""Of jitted JAX: a whole frame at once takes gigabytes."""

CONFIG = SpatialGatedConfig()
QUARTILES = {"median": 0.5, "lower": 0.25, "upper": 0.75}


def bundle() -> Bundle:
    """Random parameters, their texels rounded to half precision."""
    config: Any = CONFIG
    manifest = Manifest("random", "spatial-gated", config, Provenance("random", "", "", 0, "", 0), {}, {})
    made = Bundle(manifest, random_params(0, spatial_gated(CONFIG)))
    return from_bytes(to_bytes(made, precision="float16"), "random")


@partial(jax.jit, static_argnames="count")
def frame(key: jax.Array, *, count: int) -> Query:
    """Queries of all scales."""
    key_directions, key_places = jax.random.split(key)
    u = jax.random.uniform(key_directions, (2, count, 2))
    wi, wo = square_to_cosine(u[0]), square_to_cosine(u[1])
    uv, footprint = draw_places(key_places, wo, texels=max(CONFIG.latents.height, CONFIG.latents.width))
    return Query(wi, wo, uv, footprint)


def jax_run(made: Bundle, query: Query) -> Callable[[], Any]:
    """A function that evaluates the query with jitted JAX, `BATCH` at a time."""
    known = jax_material(made)
    evaluate = jax.jit(known.brdf.eval)
    parts = [jax.tree.map(lambda part, k=k: part[k : k + BATCH], query) for k in range(0, len(query.wi), BATCH)]

    def run() -> None:
        for part in parts:
            jax.block_until_ready(evaluate(known.params, part))

    return run


def spread(values: np.ndarray) -> dict[str, float]:
    """Median and quartiles."""
    return {name: float(np.quantile(values, share)) for name, share in QUARTILES.items()}


def measure(count: int, rounds: int) -> dict[str, Any]:
    """Every figure."""
    made, query, device = bundle(), frame(jax.random.key(1), count=count), choose()
    context = context_of(device)
    points = query._replace(footprint=None)
    half = Material.load(made, context)
    whole = Material.load(made, context, precision="float32")
    runs = {
        "opencl": opencl_run(half, query),
        "opencl_float32": opencl_run(whole, query),
        "opencl_points": opencl_run(half, points),
        "jax": jax_run(made, query),
    }
    load = os.getloadavg()[0]
    times = {name: np.array(of) for name, of in interleaved(runs, rounds).items()}
    count_of_probes = np.asarray(probes_of(CONFIG.latents.layout, query.footprint, most=CONFIG.latents.probes).count)
    return {
        "device": describe(device),
        "shape": half.shape._asdict(),
        "queries": count,
        "rounds": rounds,
        "load_before": load,
        "processors": os.cpu_count(),
        "mean_probes": float(count_of_probes.mean()),
        "milliseconds": {name: spread(1e3 * of) for name, of in times.items()},
        "nanoseconds_per_query": spread(1e9 * times["opencl"] / count),
        "jax_over_opencl": spread(times["jax"] / times["opencl"]),
    }


def main() -> None:
    found = measure(FRAME, ROUNDS)
    print(json.dumps(found, indent=1))
    RESULT.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
