"""What an evaluation costs: OpenCL on a device, jitted JAX on the processor, and the device's ceiling, in one run."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import numpy as np
import pyopencl as cl

from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.bundle import material as jax_material
from jaxbrdf.jobs.progress import Reporter
from jaxbrdf.opencl.material import Material
from jaxbrdf.sampling.footprints import draw_places
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.texture.pyramid import Layout
from jaxbrdf.types import Query

QUERIES = 250_000
"""In a timed batch. No power of two: arrays that far apart share their places in a processor's cache."""

ROUNDS = 15
"""Of a benchmark."""

PRICE_ROUNDS = 31
"""Of a timing of many candidates, of which close ones are to be told apart."""

TRIES = 3
"""Of a function in a round, of which the fastest counts."""

JAX_BATCHES = (2**12, 2**14, 2**16, 2**18)
"""Among which jitted JAX's best is looked for."""


class Price(NamedTuple):
    """Nanoseconds of an evaluation over several rounds.

    Attributes:
        ns: the median.
        lower, upper: quartiles: half of the rounds lie between them, however many others run on the machine.
        least, most: the extremes.
    """

    ns: float
    lower: float
    upper: float
    least: float
    most: float

    @property
    def told(self) -> dict[str, Any]:
        """By the names that comparisons have for them."""
        return {
            "ns_per_evaluation": self.ns,
            "ns_quartiles": [self.lower, self.upper],
            "ns_spread": [self.least, self.most],
        }


def timed_query(*, count: int = QUERIES) -> Query:
    """Pairs like those that judge a fit, half of them near highlights, `(count, 3)`."""
    drawn = draw_weighted(jax.random.key(0), -(-count // 2) * 2)[0]
    wi, wo = (w[:count] for w in drawn[:2])
    return Query(wi, wo)


def timed_query_on(layout: Layout, *, count: int = QUERIES) -> Query:
    """The same at random places of a texture, under footprints of all scales as training draws them: neighbours have
    nothing in common, unlike those of a picture."""
    query = timed_query(count=count)
    uv, footprint = draw_places(jax.random.key(1), query.wo, texels=max(layout.height, layout.width))
    return query._replace(uv=uv, footprint=footprint)


def opencl_prices(
    bundles: Mapping[str, Bundle],
    context: cl.Context,
    *,
    reporter: Reporter,
    rounds: int = PRICE_ROUNDS,
    query: Query | None = None,
) -> dict[str, Price]:
    """What an evaluation of each bundle costs on the context's device, all in the same rounds; by default of
    `timed_query`.

    Raises:
        OpenCLError: if the device refuses one.
    """
    query = timed_query() if query is None else query
    arrays, runs = device_arrays(context, query), {}
    with reporter.steps("building kernels", len(bundles)) as tell:
        for done, (name, bundle) in enumerate(bundles.items(), start=1):
            runs[name] = partial(_evaluate, Material.load(bundle, context), arrays)
            tell(done, f"{done} of {len(bundles)}")
    times = interleaved(runs, rounds)
    return {name: price_of(times[name], len(query.wi)) for name in runs}


def price_of(times: Sequence[float], count: int) -> Price:
    """The price of one of `count` evaluations that took these seconds, round by round."""
    ns = 1e9 * np.asarray(times) / count
    return Price(*(float(np.quantile(ns, share)) for share in (0.5, 0.25, 0.75, 0.0, 1.0)))


class DeviceArrays(NamedTuple):
    """A query and room for its values in a device's memory; uv and footprint are None where the query has none."""

    wi: cl.Buffer
    wo: cl.Buffer
    f: cl.Buffer
    uv: cl.Buffer | None
    footprint: cl.Buffer | None


def device_arrays(context: cl.Context, query: Query) -> DeviceArrays:
    """The query of n pairs on the context's device."""
    flags, count = cl.mem_flags, len(query.wi)

    def planar(part: jax.Array) -> cl.Buffer:
        rows = np.ascontiguousarray(np.asarray(part).reshape(count, -1).T)
        return cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=rows)

    uv, footprint = (None if part is None else planar(part) for part in (query.uv, query.footprint))
    f = cl.Buffer(context, flags.WRITE_ONLY, 12 * count)
    return DeviceArrays(planar(query.wi), planar(query.wo), f, uv, footprint)


def opencl_run(material: Material, query: Query) -> Callable[[], Any]:
    """A function that evaluates the query on the material's device, where the arrays lie already."""
    return partial(_evaluate, material, device_arrays(material.context, query))


def _evaluate(material: Material, arrays: DeviceArrays) -> None:
    wi, wo, f, uv, footprint = arrays
    material.enqueue(material.queue, wi, wo, f, uv=uv, footprint=footprint).wait()


def jax_run(bundle: Bundle, query: Query) -> Callable[[], Any]:
    """A function that evaluates the query with jitted JAX."""
    material = jax_material(bundle)
    evaluate = jax.jit(partial(material.brdf.eval, material.params))
    return lambda: jax.block_until_ready(evaluate(query))


def best_jax_run(bundle: Bundle, query: Query) -> tuple[Callable[[], Any], int]:
    """A function that evaluates jitted JAX's best batch, found here, and how many queries that is."""
    batches = [n for n in JAX_BATCHES if n <= len(query.wi)] or [len(query.wi)]
    runs = {n: jax_run(bundle, jax.tree.map(lambda part, n=n: part[:n], query)) for n in batches}
    times = interleaved({str(n): run for n, run in runs.items()}, 5)
    best = max(batches, key=lambda n: n / float(np.median(times[str(n)])))
    return runs[best], best


def interleaved(runs: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, list[float]]:
    """Seconds of each function in every round, in turn, so that a slow moment falls on all.

    Each goes once untimed before: another's threads may still be awake, and its data is in the caches. Then the least
    of three counts: what disturbs a run only makes it slower.
    """
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            run()
            times[name].append(min(seconds(run) for _ in range(TRIES)))
    return times


def seconds(run: Callable[[], Any]) -> float:
    """Of one call."""
    clock = time.perf_counter()
    run()
    return time.perf_counter() - clock
