"""How fast the kernels are on every OpenCL device, beside its FMA ceiling and jitted JAX, interleaved in one run.

    python experiments/bench_opencl.py                 # about three minutes a device
    python experiments/bench_opencl.py --only PoCL     # devices whose description holds the word

The material is the gated model at the paper's size, general variant, fitted to brushed aluminium for a few seconds.
Rates are medians over rounds, a share or a ratio is the median of the rounds' own, and each comes with its quartiles.
Writes experiments/results/opencl_speed.json, from which make_tables.py writes docs/performance.md's tables.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl as cl

from jaxbrdf import cli
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.bundle import load as load_bundle
from jaxbrdf.export.bundle import save as save_bundle
from jaxbrdf.jobs.price import best_jax_run, interleaved, opencl_run, seconds, timed_query
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.opencl import Collection, Material, ceiling, network, tuning
from jaxbrdf.opencl.material import kernel_source
from jaxbrdf.opencl.network import Network
from jaxbrdf.opencl.platform import context_of, describe, devices
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import Shape

RESULT = Path(__file__).parent / "results" / "opencl_speed.json"
ROUNDS = 21
QUERIES = 250_000
FRAME = 1920 * 1080
SMALL = 1000
MATERIALS = 25
NETWORK = (10, 32, 32, 32, 6)
QUARTILES = {"median": 0.5, "lower": 0.25, "upper": 0.75}

CHOOSING = """
__kernel void choose(__global const uint *index, __global const float *wi, __global const float *wo,
                     __global const float *parameters, __global float *f) {
    const size_t i = get_global_id(0);
    vstore3(CALL(vload3(i, wi), vload3(i, wo), parameters), i, f);
}
"""


def fitted() -> Bundle:
    """The gated model at the paper's size, fitted to the one built-in material that is anisotropic."""
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/fit.safetensors"
        # its report goes to standard output
        code = cli.run(["fit", "brushed-aluminium", "--paper-sizes", "--budget-seconds", "5", "-o", path, "--json"])
        if code:
            raise SystemExit(code)
        return load_bundle(path)


def spread(values: list[float]) -> dict[str, float]:
    """Median and quartiles."""
    return {name: float(np.quantile(values, share)) for name, share in QUARTILES.items()}


def network_run(one: Network, queue: cl.CommandQueue, count: int) -> Callable[[], Any]:
    """A function that evaluates the network for `count` inputs."""
    sizes = NETWORK[0], NETWORK[-1]
    inputs, outputs = (cl.Buffer(queue.context, cl.mem_flags.READ_WRITE, 4 * n * count) for n in sizes)
    values = np.random.default_rng(0).normal(size=sizes[0] * count).astype(np.float32)
    cl.enqueue_copy(queue, inputs, values)
    return lambda: one.enqueue(queue, count, inputs, outputs).wait()


def rates(bundle: Bundle, material: Material) -> dict[str, Any]:
    """The networks, the whole model, jitted JAX and the ceiling, in turn."""
    context, queue = material.context, material.queue
    mlp = network.random(0, NETWORK)
    networks = {name: network.load(mlp, name, context, material.shape) for name in ("relu", "silu")}
    query = timed_query(count=QUERIES)
    chains = ceiling.all_chains(context)
    jax_run, jax_count = best_jax_run(bundle, query)
    peaks: list[float] = []
    times = interleaved(
        {
            "ceiling": lambda: peaks.append(ceiling.gflops(chains, queue)),
            "relu": network_run(networks["relu"], queue, QUERIES),
            "silu": network_run(networks["silu"], queue, QUERIES),
            "gated": opencl_run(material, query),
            "jax": jax_run,
        },
        ROUNDS,
    )
    # each round's best: it takes the ceiling more than once
    peak = np.array(peaks).reshape(ROUNDS, -1).max(axis=1)
    jax_rates = jax_count / np.array(times["jax"])
    gated = QUERIES / np.array(times["gated"])
    shares = {
        name: spread(list(one.operations * QUERIES / np.array(times[name]) / 1e9 / peak))
        for name, one in networks.items()
    }
    return {
        "fma_ceiling_gflops": spread(list(peak)),
        "network_share_of_ceiling": shares,
        "network_evaluations_per_second": {name: spread(list(QUERIES / np.array(times[name]))) for name in networks},
        "gated_evaluations_per_second": spread(list(gated)),
        "gated_evaluations_per_second_per_gflops": spread(list(gated / peak)),
        "jax_evaluations_per_second": spread(list(jax_rates)),
        "gated_over_jax": spread(list(gated / jax_rates)),
    }


def frame(material: Material) -> dict[str, float]:
    """Milliseconds of one evaluation for each pixel of 1920 x 1080."""
    return spread([1e3 * s for s in interleaved({"": opencl_run(material, timed_query(count=FRAME))}, 9)[""]])


def small_call(material: Material) -> dict[str, float]:
    """Microseconds of a whole call for a thousand queries, from numpy to numpy."""
    query = timed_query(count=SMALL)
    wi, wo = np.asarray(query.wi), np.asarray(query.wo)
    return spread([1e6 * s for s in interleaved({"": lambda: material.evaluate(wi, wo)}, 200)[""]])


def builds(bundle: Bundle, shape: Shape, device: cl.Device) -> dict[str, float]:
    """Seconds to build the kernel where no cache holds it, and milliseconds where ours does, each in a new process."""
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/bundle.safetensors"
        save_bundle(path, bundle)
        # PoCL keeps a cache of its own
        own = {"XDG_CACHE_HOME": f"{folder}/ours", "POCL_CACHE_DIR": f"{folder}/pocl"}
        place = str(devices().index(device))
        command = [sys.executable, __file__, "--build", place, path, f"{shape.width},{shape.rows}"]
        cold, cached = (
            float(subprocess.run(command, env=os.environ | own, capture_output=True, text=True, check=True).stdout)
            for _ in range(2)
        )
    return {"cold_seconds": cold, "cached_milliseconds": 1e3 * cached}


def print_build_seconds(place: str, path: str, shape: str) -> None:
    """What the processes of `builds` do."""
    device = devices()[int(place)]
    width, rows = map(int, shape.split(","))
    source = kernel_source(load_bundle(path), "float32", Shape(width, rows), device)
    context = context_of(device)
    print(seconds(lambda: build(context, source)))


def without_effects(bundle: Bundle) -> Iterator[tuple[str, Bundle]]:
    """The material, and the same less one effect after the other."""
    yield "all", _with(bundle, horizon=True)
    yield "azimuth of wh", _with(bundle, horizon=True, isotropic=True)
    yield "warps", _with(bundle, horizon=True, warps=False)
    yield "growth to the horizon", _with(bundle)


def _with(bundle: Bundle, *, horizon: bool = False, isotropic: bool = False, warps: bool = True) -> Bundle:
    config, params = bundle.manifest.config, bundle.params
    params = params._replace(horizon=np.float32(0.5) if horizon else None)
    config = replace(config, horizon=horizon, textures=replace(config.textures, isotropic=isotropic))
    if isotropic:
        params = params._replace(h=params.h[:, :, :1])
    if not warps:
        config = replace(config, h_exponents=(), d_exponents=())
        params = params._replace(warp_h=None, warp_d=None)
    return Bundle(bundle.manifest._replace(config=config), params)


def effects(bundle: Bundle, context: cl.Context) -> list[dict[str, Any]]:
    """Nanoseconds an evaluation with all effects, and what leaving one out saves."""
    query = timed_query(count=QUERIES)
    materials = {name: Material.load(one, context, precision="float32") for name, one in without_effects(bundle)}
    runs = {name: opencl_run(material, query) for name, material in materials.items()}
    runs["float32 texels (float16 instead)"] = opencl_run(
        Material.load(_with(bundle, horizon=True), context, precision="float16"), query
    )
    times = interleaved(runs, ROUNDS)
    nanoseconds = {name: 1e9 * np.array(of) / QUERIES for name, of in times.items()}
    rows = [{"effect": "all of these", "nanoseconds": spread(list(nanoseconds.pop("all")))}]
    whole = 1e9 * np.array(times["all"]) / QUERIES
    return rows + [{"effect": name, "saved": spread(list(whole - of))} for name, of in nanoseconds.items()]


def choosing(bundle: Bundle, context: cl.Context, queue: cl.CommandQueue) -> dict[str, Any]:
    """Nanoseconds of an inline evaluation, one query a work item: of one material, and of one among 25 by its index."""
    rng = np.random.default_rng(0)
    others = [_perturbed(rng, bundle) for _ in range(MATERIALS)]
    query = timed_query(count=QUERIES)
    index = rng.integers(0, MATERIALS, QUERIES).astype(np.uint32)
    cases = {"one": (Collection.load(others[:1]), "material_0_eval")}
    cases["one_of_25"] = (Collection.load(others), "material_eval")
    runs = {}
    for name, (collection, function) in cases.items():
        call = f"{function}(" if name == "one" else f"{function}(index[i], "
        source = collection.source + CHOOSING.replace("CALL(", call)
        runs[name] = _choosing_run(context, queue, source, collection, index, query)
    times = interleaved(runs, ROUNDS)
    return {name: spread(list(1e9 * np.array(of) / QUERIES)) for name, of in times.items()}


def _perturbed(rng: np.random.Generator, bundle: Bundle) -> Bundle:
    mlp = bundle.params.mlp
    biases = tuple(b + 0.1 * rng.normal(size=b.shape).astype(np.float32) for b in mlp.biases)
    return bundle._replace(params=bundle.params._replace(mlp=Mlp(mlp.weights, biases)))


def _choosing_run(context, queue, source, collection, index, query) -> Callable[[], Any]:
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    arrays = [index, np.asarray(query.wi), np.asarray(query.wo), collection.parameters]
    buffers = [cl.Buffer(context, flags, hostbuf=np.ascontiguousarray(array)) for array in arrays]
    output = cl.Buffer(context, cl.mem_flags.WRITE_ONLY, 12 * len(index))
    kernel = cl.Kernel(build(context, source), "choose")

    def run() -> None:
        # a kernel does not keep its buffers alive: the arguments are set where they are at hand
        kernel.set_args(*buffers, output)
        cl.enqueue_nd_range_kernel(queue, kernel, (len(index),), None).wait()

    return run


def measure(bundle: Bundle, device: cl.Device) -> dict[str, Any]:
    """Every figure of one device."""
    context = context_of(device)
    shape = tuning.best_shape(device)
    material = Material.load(bundle, context, precision="float32", shape=shape)
    return {
        "device": describe(device),
        "driver": device.driver_version,
        "units": device.max_compute_units,
        "shape": shape._asdict(),
        **rates(bundle, material),
        "frame_milliseconds": frame(material),
        "call_microseconds": small_call(material),
        **builds(bundle, shape, device),
        "effects": effects(bundle, context),
        "choosing_nanoseconds": choosing(bundle, context, material.queue),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="a word in the description of the devices wanted")
    parser.add_argument("--build", nargs=3, metavar=("PLACE", "BUNDLE", "SHAPE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.build:
        print_build_seconds(*options.build)
        return
    only = options.only.lower()
    cli.use_every_core()
    bundle = fitted()
    rows = json.loads(RESULT.read_text()) if RESULT.exists() else []
    for device in devices():
        if only in describe(device).lower():
            row = measure(bundle, device)
            print(json.dumps(row, indent=1), flush=True)
            rows = [*(old for old in rows if old["device"] != row["device"]), row]
            RESULT.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
