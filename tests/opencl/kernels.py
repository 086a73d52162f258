"""Runs one function of kernels_cl/include alone, over a batch."""

from __future__ import annotations

import numpy as np
import pyopencl as cl

from jaxbrdf.opencl.program import build
from tests.opencl.conftest import Device


def run(
    opencl: Device,
    includes: list[str],
    body: str,
    inputs: dict[str, np.ndarray],
    width: int,
    *,
    constants: dict[str, str] | None = None,
) -> np.ndarray:
    """`body` for each work item i, which reads `inputs` (float arrays) and writes `out`, float `(count, width)`."""
    arguments = ", ".join(f"__global const float *{name}" for name in inputs)
    headers = "\n".join(f'#include "{name}.cl"' for name in includes)
    source = f"""{headers}
    __kernel void run({arguments}, __global float *results) {{
        const size_t i = get_global_id(0);
        float out[{width}];
        {body}
        for (int k = 0; k < {width}; ++k) results[i * {width} + k] = out[k];
    }}"""
    program = build(opencl.context, source, constants or {})
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    arrays = [np.ascontiguousarray(value, np.float32) for value in inputs.values()]
    buffers = [cl.Buffer(opencl.context, flags, hostbuf=array) for array in arrays]
    results = np.empty((len(arrays[0]), width), np.float32)
    output = cl.Buffer(opencl.context, cl.mem_flags.WRITE_ONLY, results.nbytes)
    kernel = cl.Kernel(program, "run")
    kernel.set_args(*buffers, output)
    cl.enqueue_nd_range_kernel(opencl.queue, kernel, (len(results),), None)
    cl.enqueue_copy(opencl.queue, results, output, is_blocking=True)
    return results
