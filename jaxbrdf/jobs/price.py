"""What an evaluation costs: OpenCL on a device, jitted JAX on the processor, and the device's ceiling, in one run."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import jax
import numpy as np
import pyopencl as cl

from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.opencl.material import Material
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Query

QUERIES = 250_000
"""In a timed batch. No power of two: arrays that far apart share their places in a processor's cache."""

JAX_BATCHES = (2**12, 2**14, 2**16, 2**18)
"""Among which jitted JAX's best is looked for."""


def timed_query(*, count: int = QUERIES) -> Query:
    """Pairs like those that judge a fit, half of them near highlights, `(count, 3)`."""
    drawn = draw_weighted(jax.random.key(0), -(-count // 2) * 2)[0]
    wi, wo = (w[:count] for w in drawn[:2])
    return Query(wi, wo)


def opencl_run(material: Material, query: Query) -> Callable[[], Any]:
    """A function that evaluates the query on the material's device, where the arrays lie already."""
    flags = cl.mem_flags
    planar = [np.ascontiguousarray(np.asarray(w).T) for w in (query.wi, query.wo)]
    inputs = [cl.Buffer(material.context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=w) for w in planar]
    output = cl.Buffer(material.context, flags.WRITE_ONLY, planar[0].nbytes)
    wi, wo = inputs
    return lambda: material.enqueue(material.queue, wi, wo, output).wait()


def jax_run(bundle: Bundle, query: Query) -> Callable[[], Any]:
    """A function that evaluates the query with jitted JAX."""
    material = bundles.material(bundle)
    evaluate = jax.jit(partial(material.brdf.eval, material.params))
    return lambda: jax.block_until_ready(evaluate(query))


def jax_rate(bundle: Bundle, query: Query) -> Callable[[], float]:
    """A function that measures evaluations a second at jitted JAX's best batch, found here."""
    batches = [n for n in JAX_BATCHES if n <= len(query.wi)] or [len(query.wi)]
    runs = {n: jax_run(bundle, Query(query.wi[:n], query.wo[:n])) for n in batches}
    times = interleaved({str(n): run for n, run in runs.items()}, 5)
    best = max(batches, key=lambda n: n / float(np.median(times[str(n)])))
    return lambda: best / seconds(runs[best])


def interleaved(runs: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, list[float]]:
    """Seconds of each function in every round, in turn, so that a slow moment falls on all; one round goes before."""
    for run in runs.values():
        run()
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            times[name].append(seconds(run))
    return times


def seconds(run: Callable[[], Any]) -> float:
    """Of one call."""
    clock = time.perf_counter()
    run()
    return time.perf_counter() - clock
