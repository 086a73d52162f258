"""Runs one function of kernels_cl/include alone, over a batch, at any width."""

from __future__ import annotations

import numpy as np
import pyopencl as cl

from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.opencl.source import helpers, settings
from tests.opencl.conftest import Device

SHAPES = (Shape(1, 8), Shape(4, 8), Shape(8, 8), Shape(16, 6))


def run(
    opencl: Device,
    includes: list[str],
    body: str,
    inputs: dict[str, np.ndarray],
    outputs: int,
    *,
    shape: Shape = SHAPES[0],
    memory: dict[str, np.ndarray] | None = None,
) -> np.ndarray:
    """`body` for each work item, which reads a jb_real for each column of `inputs` and writes jb_reals `out[outputs]`.

    Args:
        opencl: where it runs.
        includes: names of helpers.
        body: statements; a column k of the input `name` is the variable `name_k`.
        inputs: arrays `(count, columns)` of float, one row a query.
        outputs: the number of results.
        shape: of the kernel.
        memory: arrays of float or half that the body reads as pointers by their names.
    """
    columns = {f"{name}_{k}": value[:, k] for name, value in inputs.items() for k in range(value.shape[1])}
    count = len(next(iter(columns.values())))
    padded = -(-count // shape.width) * shape.width
    memory = memory or {}
    kinds = {name: "half" if value.dtype == np.float16 else "float" for name, value in memory.items()}
    parameters = [f"__global const float *{name}_all" for name in columns]
    parameters += [f"__global const {kind} *{name}" for name, kind in kinds.items()]
    loads = "\n".join(f"const jb_real {name} = jb_load({name}_all, first, {padded});" for name in columns)
    source = settings(shape, "float16" if "half" in kinds.values() else "float32") + helpers("queries", *includes)
    source += f"""__kernel void run({", ".join(parameters)}, __global float *results) {{
        const size_t first = get_global_id(0) * JB_WIDTH;
        jb_real out[{outputs}];
        {loads}
        {body}
        for (int k = 0; k < {outputs}; ++k) jb_store(results + k * {padded}, first, {padded}, out[k]);
    }}"""
    program = build(opencl.context, source)
    arrays = [np.resize(np.asarray(column, np.float32), padded) for column in columns.values()]
    arrays += [np.ascontiguousarray(value) for value in memory.values()]
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    buffers = [cl.Buffer(opencl.context, flags, hostbuf=array) for array in arrays]
    results = np.empty((outputs, padded), np.float32)
    output = cl.Buffer(opencl.context, cl.mem_flags.WRITE_ONLY, results.nbytes)
    kernel = cl.Kernel(program, "run")
    kernel.set_args(*buffers, output)
    cl.enqueue_nd_range_kernel(opencl.queue, kernel, (padded // shape.width,), None)
    cl.enqueue_copy(opencl.queue, results, output, is_blocking=True)
    return results[:, :count].T
