"""A bare network on a device: what the decoder of a model costs by itself."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pyopencl as cl

from jaxbrdf.models.mlp import Mlp
from jaxbrdf.opencl.parameters import network
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.opencl.source import entry_points, settings


class Network(NamedTuple):
    """A compiled network.

    Attributes:
        kernel: `(count, inputs, outputs, parameters)`, planar float arrays.
        parameters: in the device's memory.
        shape: of the kernel.
        operations: floating-point operations of the products and sums for one query.
    """

    kernel: cl.Kernel
    parameters: cl.Buffer
    shape: Shape
    operations: int

    def enqueue(self, queue: cl.CommandQueue, count: int, inputs: cl.Buffer, outputs: cl.Buffer) -> cl.Event:
        """Starts the evaluation of `count` queries, from `(n_in, count)` to `(n_out, count)`."""
        self.kernel.set_args(np.uint64(count), inputs, outputs, self.parameters)
        return cl.enqueue_nd_range_kernel(queue, self.kernel, self.shape.grid(count), (self.shape.group,))


def load(mlp: Mlp, activation: str, context: cl.Context, shape: Shape) -> Network:
    """The network compiled for its sizes.

    Args:
        mlp: weights `(n_in, n_out)` and biases.
        activation: after every layer but the last, `silu` or `relu`.
        context: made by the caller.
        shape: of the kernel.

    Raises:
        OpenCLError: if the device's compiler refuses.
    """
    macros, values = network(mlp, shape, activation=activation)
    sizes = {"JB_MLP_INPUTS": str(mlp.weights[0].shape[0]), "JB_MLP_OUTPUTS": str(mlp.biases[-1].shape[0])}
    source = settings(shape, "float32") + entry_points(None, "network", macros | sizes, prefix="bare")
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    operations = 2 * sum(weight.size for weight in mlp.weights)
    kernel = cl.Kernel(build(context, source), "bare_network")
    return Network(kernel, cl.Buffer(context, flags, hostbuf=values), shape, operations)


def random(seed: int, widths: tuple[int, ...]) -> Mlp:
    """A network with weights of variance 1 / n_in, as numpy arrays in float32."""
    rng = np.random.default_rng(seed)
    sizes = list(pairwise(widths))
    weights: Any = tuple(np.asarray(rng.normal(size=size) / np.sqrt(size[0]), np.float32) for size in sizes)
    biases: Any = tuple(np.asarray(rng.normal(size=n), np.float32) for _, n in sizes)
    return Mlp(weights, biases)
