"""How fast a bundle is on a device: beside the device's ceiling and jitted JAX, measured in the same run."""

from __future__ import annotations

import time
from typing import Any

import jax
import numpy as np

from jaxbrdf.jobs.price import interleaved, jax_rate, opencl_run, timed_query
from jaxbrdf.jobs.source import open_bundle
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.opencl import ceiling
from jaxbrdf.opencl.material import Material
from jaxbrdf.opencl.platform import choose, context_of, describe

ROUNDS = 15


def bench(name: str) -> dict[str, Any]:
    """Rates of the bundle on the chosen device, medians over interleaved rounds.

    `gflops` counts the products and sums of the network's layers alone, `fma_ceiling_gflops` is the best round.

    Raises:
        JaxbrdfError: if the bundle or the device cannot be used.
    """
    bundle = open_bundle(name)
    context = context_of(choose())
    clock = time.perf_counter()
    material = Material.load(bundle, context)
    build_seconds = time.perf_counter() - clock
    query = timed_query()
    count = len(query.wi)
    run = opencl_run(material, query)
    jax_evaluations = jax_rate(bundle, query)
    chains = ceiling.all_chains(context)
    rates: dict[str, list[float]] = {"jax": [], "ceiling": []}
    times = interleaved(
        {
            "opencl": run,
            "jax": lambda: rates["jax"].append(jax_evaluations()),
            "ceiling": lambda: rates["ceiling"].append(ceiling.gflops(chains, material.queue)),
        },
        ROUNDS,
    )["opencl"]
    nanoseconds = 1e9 * np.array(times) / count
    median = float(np.median(nanoseconds))
    return {
        "device": describe(material.queue.device),
        "width": material.shape.width,
        "precision": material.precision,
        "ns_per_evaluation": median,
        "ns_spread": [float(nanoseconds.min()), float(nanoseconds.max())],
        "evaluations_per_second": 1e9 / median,
        "gflops": network_operations(bundle.params) / median,
        "fma_ceiling_gflops": max(rates["ceiling"]),
        "jax_evaluations_per_second": float(np.median(rates["jax"])),
        "build_seconds": build_seconds,
    }


def network_operations(params: Any) -> int:
    """Floating-point operations of a decoder's products and sums for one query."""
    layers = jax.tree.leaves(params, is_leaf=lambda part: isinstance(part, Mlp))
    return 2 * sum(int(np.size(w)) for part in layers if isinstance(part, Mlp) for w in part.weights)
