"""A bundle's sampler on a device: directions to the light and their densities, for batches of viewers."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from os import PathLike
from typing import NamedTuple

import numpy as np
import pyopencl as cl

from jaxbrdf.errors import OpenCLError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.opencl import tuning
from jaxbrdf.opencl.arrays import DeviceArray
from jaxbrdf.opencl.platform import describe, is_gpu
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import INLINE, Shape
from jaxbrdf.opencl.source import entry_points, settings

PREFIX = "material"
PLANAR, INTERLEAVED = 0, 1


class Drawn(NamedTuple):
    """Directions to the light `(..., 3)`, some below the horizon, and their densities [1/sr], `(...)`, zero there."""

    wi: np.ndarray
    pdf: np.ndarray


class Sampler(NamedTuple):
    """A compiled sampler.

    Attributes:
        bundle: what it was made of.
        shape: of its kernels.
        context: the one it was compiled for.
        queue: where `sample` and `pdf` run.
        draw: the kernel `(count, is_interleaved, wo, u, wi, pdf, nodes)`.
        density: the kernel `(count, is_interleaved, wi, wo, pdf, nodes)`.
        lock: held while a kernel's arguments are set.
        nodes: in the device's memory.
    """

    bundle: Bundle
    shape: Shape
    context: cl.Context
    queue: cl.CommandQueue
    draw: cl.Kernel
    density: cl.Kernel
    lock: threading.Lock
    nodes: cl.Buffer

    @classmethod
    def load(cls, bundle: Bundle | str | PathLike[str], context: cl.Context, *, shape: Shape | None = None) -> Sampler:
        """The kernels of the bundle's sampler.

        Args:
            bundle: or the path of its file.
            context: made by the caller; the kernels are cut for its first device.
            shape: of the kernels; by default the one that evaluates materials fastest on this device.

        Raises:
            DataError: if the file is not a sound bundle.
            ValueError: if the bundle has no sampler.
            OpenCLError: if the device's compiler or memory refuses.
        """
        if not isinstance(bundle, Bundle):
            bundle = bundles.load(bundle)
        nodes = proxy_nodes(bundle)
        device = context.devices[0]
        shape = shape or tuning.best_shape(device)
        points = entry_points(None, "sample", proxy_macros(nodes), prefix=PREFIX)
        program = build(context, settings(shape, "float32", unroll=is_gpu(device)) + points)
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
        try:
            buffer = cl.Buffer(context, flags, hostbuf=nodes)
            queue = cl.CommandQueue(context, device)
        except cl.Error as error:
            raise OpenCLError(f"the sampler does not fit on {describe(device)}: {error}") from None
        draw, density = (cl.Kernel(program, f"{PREFIX}_{name}") for name in ("sample", "pdf"))
        return cls(bundle, shape, context, queue, draw, density, threading.Lock(), buffer)

    def sample(self, wo: np.ndarray, u: np.ndarray) -> Drawn:
        """Directions to the light for viewers `wo`, unit vectors `(..., 3)`, of u uniform in [0, 1), `(..., 3)`.

        Raises:
            ValueError: if the shapes are not as told.
            OpenCLError: if the device fails.
        """
        rows, shape = _rows(wo=wo, u=u)
        wi, pdf = np.empty_like(rows[0]), np.empty(len(rows[0]), np.float32)
        self._run(self.draw, rows, (wi, pdf))
        return Drawn(wi.reshape(shape), pdf.reshape(shape[:-1]))

    def pdf(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """Densities [1/sr] `(...)` of directions `wi` for viewers `wo`, `(..., 3)`; zero below the horizon.

        Raises:
            ValueError: if the shapes are not as told.
            OpenCLError: if the device fails.
        """
        rows, shape = _rows(wi=wi, wo=wo)
        pdf = np.empty(len(rows[0]), np.float32)
        self._run(self.density, rows, (pdf,))
        return pdf.reshape(shape[:-1])

    def enqueue_sample(
        self,
        queue: cl.CommandQueue,
        wo: DeviceArray,
        u: DeviceArray,
        wi: DeviceArray,
        pdf: DeviceArray,
        count: int,
        *,
        wait_for: Sequence[cl.Event] | None = None,
    ) -> cl.Event:
        """Starts `sample` on the caller's own arrays, planar `(3, count)` and for pdf `(count,)`; nothing is copied.

        Raises:
            OpenCLError: if the device fails.
        """
        return self._enqueue(queue, self.draw, count, PLANAR, (wo, u, wi, pdf), wait_for)

    def enqueue_pdf(
        self,
        queue: cl.CommandQueue,
        wi: DeviceArray,
        wo: DeviceArray,
        pdf: DeviceArray,
        count: int,
        *,
        wait_for: Sequence[cl.Event] | None = None,
    ) -> cl.Event:
        """Starts `pdf` on the caller's own arrays, planar `(3, count)` and for pdf `(count,)`; nothing is copied.

        Raises:
            OpenCLError: if the device fails.
        """
        return self._enqueue(queue, self.density, count, PLANAR, (wi, wo, pdf), wait_for)

    def _enqueue(
        self,
        queue: cl.CommandQueue,
        kernel: cl.Kernel,
        count: int,
        layout: int,
        arrays: Sequence[DeviceArray],
        wait_for: Sequence[cl.Event] | None,
    ) -> cl.Event:
        if count == 0:
            return cl.enqueue_marker(queue, wait_for=wait_for)
        buffers = [getattr(array, "data", array) for array in arrays]
        try:
            with self.lock:
                kernel.set_args(np.uint64(count), np.uint32(layout), *buffers, self.nodes)
                return cl.enqueue_nd_range_kernel(
                    queue, kernel, self.shape.grid(count), (self.shape.group,), wait_for=wait_for
                )
        except cl.Error as error:
            raise OpenCLError(f"{describe(queue.device)} cannot draw {count} directions: {error}") from None

    def _run(self, kernel: cl.Kernel, inputs: Sequence[np.ndarray], outputs: Sequence[np.ndarray]) -> None:
        """On arrays of the host, of one row a query."""
        count, flags = len(inputs[0]), cl.mem_flags
        if count == 0:
            return
        try:
            given = [cl.Buffer(self.context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=array) for array in inputs]
            made = [cl.Buffer(self.context, flags.WRITE_ONLY, array.nbytes) for array in outputs]
            done = self._enqueue(self.queue, kernel, count, INTERLEAVED, (*given, *made), None)
            for array, buffer in zip(outputs, made, strict=True):
                cl.enqueue_copy(self.queue, array, buffer, wait_for=[done])
        except cl.Error as error:
            raise OpenCLError(f"{describe(self.queue.device)} cannot draw {count} directions: {error}") from None


def sampler_source(bundle: Bundle, *, entry: str = "material_0") -> str:
    """OpenCL C for a kernel of the caller's own, to stand behind `Material.source` of the same entry.

    It defines `float3 {entry}_sample(float3 wo, float3 u, float *pdf, __global const float *nodes)` and
    `float {entry}_pdf(float3 wi, float3 wo, __global const float *nodes)`; `nodes` is a buffer of `proxy_nodes`.

    Raises:
        ValueError: if the bundle has no sampler, or `entry` is not an identifier.
    """
    if not entry.isidentifier():
        raise ValueError(f"entry {entry!r} is not an identifier")
    points = entry_points(None, "inline_sample", proxy_macros(proxy_nodes(bundle)), prefix=entry)
    return settings(INLINE, "float32") + points


def proxy_nodes(bundle: Bundle) -> np.ndarray:
    """The numbers that a sampler's kernels read, float32 `(azimuths, elevations, 9)`.

    Raises:
        ValueError: if the bundle has no sampler.
    """
    if bundle.parts.sampler is None:
        raise ValueError(f"{bundle.manifest.name} has no sampler: it was fitted without one")
    return np.ascontiguousarray(bundle.parts.sampler.nodes, np.float32)


def proxy_macros(nodes: np.ndarray) -> dict[str, str]:
    """The sizes that the sampler's kernels are compiled for."""
    azimuths, elevations, _ = nodes.shape
    return {"JB_PROXY_AZIMUTHS": str(azimuths), "JB_PROXY_ELEVATIONS": str(elevations)}


def _rows(**arrays: np.ndarray) -> tuple[list[np.ndarray], tuple[int, ...]]:
    """Arrays `(..., 3)` of one shape as rows, and that shape."""
    given = {name: np.asarray(array) for name, array in arrays.items()}
    shapes = {array.shape for array in given.values()}
    if len(shapes) > 1 or next(iter(shapes))[-1:] != (3,):
        told = " and ".join(f"{name} {array.shape}" for name, array in given.items())
        raise ValueError(f"{told} must have one shape (..., 3)")
    return [np.ascontiguousarray(array, np.float32).reshape(-1, 3) for array in given.values()], shapes.pop()
