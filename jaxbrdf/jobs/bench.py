"""How fast a bundle is on a device: beside the device's ceiling and jitted JAX, measured in the same run."""

from __future__ import annotations

import time
from typing import Any

import jax
import numpy as np

from jaxbrdf.jobs.price import ROUNDS, best_jax_run, interleaved, opencl_run, price_of, timed_query, timed_query_on
from jaxbrdf.jobs.source import open_bundle
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.opencl import ceiling
from jaxbrdf.opencl.material import Material
from jaxbrdf.opencl.platform import choose, context_of, describe


def bench(name: str) -> dict[str, Any]:
    """Rates of the bundle on the chosen device, medians over interleaved rounds.

    `gflops` counts the products and sums of the network's layers alone, `fma_ceiling_gflops` is the best round. Of a
    material over a surface the queries are at random places under footprints of all scales.

    Raises:
        JaxbrdfError: if the bundle or the device cannot be used.
    """
    bundle = open_bundle(name, surfaces=True)
    context = context_of(choose())
    clock = time.perf_counter()
    material = Material.load(bundle, context)
    build_seconds = time.perf_counter() - clock
    query = timed_query_on(bundle.manifest.config.latents.layout) if bundle.manifest.is_spatial else timed_query()
    run = opencl_run(material, query)
    jax_run, jax_count = best_jax_run(bundle, query)
    chains, peaks = ceiling.all_chains(context), []
    times = interleaved(
        {
            "opencl": run,
            "jax": jax_run,
            "ceiling": lambda: peaks.append(ceiling.gflops(chains, material.queue)),
        },
        ROUNDS,
    )
    price = price_of(times["opencl"], len(query.wi))
    return {
        "name": bundle.manifest.name,
        "model": bundle.manifest.model,
        "device": describe(material.queue.device),
        "width": material.shape.width,
        "precision": material.precision,
        "ns_per_evaluation": price.ns,
        "ns_spread": [price.least, price.most],
        "evaluations_per_second": 1e9 / price.ns,
        "gflops": network_operations(bundle.params) / price.ns,
        "fma_ceiling_gflops": max(peaks),
        "jax_evaluations_per_second": 1e9 / price_of(times["jax"], jax_count).ns,
        "build_seconds": build_seconds,
    }


def network_operations(params: Any) -> int:
    """Floating-point operations of a decoder's products and sums for one query."""
    layers = jax.tree.leaves(params, is_leaf=lambda part: isinstance(part, Mlp))
    return 2 * sum(int(np.size(w)) for part in layers if isinstance(part, Mlp) for w in part.weights)
