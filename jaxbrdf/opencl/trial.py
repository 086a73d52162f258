"""How fast is each shape of kernel on a device? Run as a process of its own, for a driver's compiler may crash.

    python -m jaxbrdf.opencl.trial PLACE WIDTH,ROWS WIDTH,ROWS ...

PLACE is the device's among `platform.devices()`. For each shape that works it prints a line `WIDTH,ROWS SECONDS`, and
again for every further round: the least of a shape's times counts.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import pyopencl as cl

from jaxbrdf.errors import OpenCLError
from jaxbrdf.opencl import network
from jaxbrdf.opencl.network import Network
from jaxbrdf.opencl.platform import context_of, devices
from jaxbrdf.opencl.shape import Shape

WIDTHS = (12, 24, 24, 3)
"""A decoder between the smallest and the largest of the models'."""

COUNT = 2**16
ROUNDS = 40
"""Half a second of them: fewer may all fall into moments when somebody else slows one shape more than another."""


def main(arguments: list[str]) -> None:
    """Prints the times."""
    context = context_of(devices()[int(arguments[0])])
    queue = cl.CommandQueue(context)
    buffers = [cl.Buffer(context, cl.mem_flags.READ_WRITE, 4 * n * COUNT) for n in (WIDTHS[0], WIDTHS[-1])]
    cl.enqueue_copy(queue, buffers[0], np.ones(WIDTHS[0] * COUNT, np.float32))
    loaded: dict[str, Network] = {}
    for text in arguments[1:]:
        width, rows = map(int, text.split(","))
        # said first, so that after a crash the last line names the shape that crashed
        print(text, flush=True)
        try:
            loaded[text] = network.load(network.random(0, WIDTHS), "silu", context, Shape(width, rows))
            seconds(loaded[text], queue, buffers)
        except (OpenCLError, cl.Error):
            loaded.pop(text, None)
    for _ in range(ROUNDS):
        for text, one in loaded.items():
            print(text, seconds(one, queue, buffers), flush=True)


def seconds(one: Network, queue: cl.CommandQueue, buffers: list[cl.Buffer]) -> float:
    """Of one evaluation of `COUNT` queries."""
    clock = time.perf_counter()
    one.enqueue(queue, COUNT, *buffers).wait()
    return time.perf_counter() - clock


if __name__ == "__main__":
    main(sys.argv[1:])
