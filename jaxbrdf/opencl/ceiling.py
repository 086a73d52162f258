"""The most that a device can do: independent chains of fused multiply-adds, and nothing else."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
import pyopencl as cl

from jaxbrdf.opencl.platform import is_gpu
from jaxbrdf.opencl.program import build

LENGTH = 4096
"""Steps of a chain: a work item runs for some ten microseconds."""

PROCESSOR_CUTS = ((16, 8), (16, 6), (8, 12), (8, 10))
GPU_CUTS = ((1, 8), (1, 16))
"""Vector widths, and numbers of chains, that hide the latency and fit into some device's registers."""

SHORTEST = 4e-3
"""Seconds a timed run takes at least: starting the kernel takes a hundredth of it."""

SOURCE = """
#pragma OPENCL FP_CONTRACT ON
__kernel __attribute__((reqd_work_group_size(GROUP, 1, 1))) void chains(
    __global VECTOR *out, const float a, const float b, const int length) {
    const VECTOR factor = (VECTOR)(a), summand = (VECTOR)(b);
    VECTOR x[CHAINS];
    #pragma unroll
    for (int j = 0; j < CHAINS; ++j) x[j] = (VECTOR)((float)(get_global_id(0) + j));
    for (int i = 0; i < length; ++i) {
        #pragma unroll
        for (int j = 0; j < CHAINS; ++j) x[j] = MULTIPLY_ADD;
    }
    VECTOR sum = x[0];
    #pragma unroll
    for (int j = 1; j < CHAINS; ++j) sum += x[j];
    out[get_global_id(0)] = sum;
}
"""
FORMS = {"contracted": "x[j] * factor + summand", "fma": "fma(x[j], factor, summand)"}
"""Drivers differ in which they turn into one instruction without a call."""


class Chains(NamedTuple):
    """A compiled kernel of chains.

    Attributes:
        kernel: `(out, a, b, length)`.
        out: its results.
        items: work items in all.
        group: of them in a work group.
        operations: of all work items in one step.
    """

    kernel: cl.Kernel
    out: cl.Buffer
    items: int
    group: int
    operations: int


def all_chains(context: cl.Context) -> list[Chains]:
    """Kernels of several cuts, of which the fastest is the ceiling.

    Eight chains of 16 are what registers of 512 bits want; narrower ones spill those, and run fewer or narrower chains
    faster.
    """
    cuts = GPU_CUTS if is_gpu(context.devices[0]) else PROCESSOR_CUTS
    chains = [_chains(context, width, count, form) for width, count in cuts for form in FORMS]
    queue = cl.CommandQueue(context)
    for one in chains:
        # some drivers compile at the first run
        _seconds(one, queue, 1)
    return chains


def gflops(chains: list[Chains], queue: cl.CommandQueue) -> float:
    """The ceiling as one round over the kernels finds it, 1e9 operations a second; a fused multiply-add is two."""
    return max(_gflops(one, queue) for one in chains)


def _chains(context: cl.Context, width: int, count: int, form: str) -> Chains:
    device = context.devices[0]
    group, per_unit = (128, 2048) if is_gpu(device) else (1, 64)
    vector = "float" if width == 1 else f"float{width}"
    defined = {"VECTOR": vector, "CHAINS": count, "MULTIPLY_ADD": FORMS[form], "GROUP": group}
    macros = "".join(f"#define {name} {value}\n" for name, value in defined.items())
    items = per_unit * device.max_compute_units
    out = cl.Buffer(context, cl.mem_flags.WRITE_ONLY, 4 * width * items)
    kernel = cl.Kernel(build(context, macros + SOURCE), "chains")
    return Chains(kernel, out, items, group, 2 * width * count * items)


def _gflops(one: Chains, queue: cl.CommandQueue) -> float:
    length = LENGTH
    while (elapsed := _seconds(one, queue, length)) < SHORTEST:
        length *= 2
    return one.operations * length / elapsed / 1e9


def _seconds(one: Chains, queue: cl.CommandQueue, length: int) -> float:
    one.kernel.set_args(one.out, np.float32(0.999), np.float32(1e-3), np.int32(length))
    clock = time.perf_counter()
    cl.enqueue_nd_range_kernel(queue, one.kernel, (one.items,), (one.group,)).wait()
    return time.perf_counter() - clock
