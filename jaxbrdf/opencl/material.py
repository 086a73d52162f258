"""A material on a device: its kernel, its numbers, and their evaluation for batches of direction pairs."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Sequence
from os import PathLike
from typing import NamedTuple

import numpy as np
import pyopencl as cl

from jaxbrdf.errors import OpenCLError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle, Precision
from jaxbrdf.export.manifest import Manifest
from jaxbrdf.opencl import tuning
from jaxbrdf.opencl.arrays import DeviceArray, queries_in
from jaxbrdf.opencl.parameters import parameters, stored_precision
from jaxbrdf.opencl.platform import describe, is_gpu
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import INLINE, Shape
from jaxbrdf.opencl.source import entry_points, settings

KERNEL = "material"
PLANAR, INTERLEAVED = 0, 1
READ = cl.map_flags.READ

SMALL_BATCH = 4096
"""Queries, up to which `evaluate` polls for the end: they take a tenth of a millisecond."""

POLL_SECONDS = 5e-4
"""At most: after that something else wants the processor."""

OUT_OF_MEMORY = {
    cl.status_code.MEM_OBJECT_ALLOCATION_FAILURE,
    cl.status_code.OUT_OF_RESOURCES,
    cl.status_code.OUT_OF_HOST_MEMORY,
    cl.status_code.INVALID_BUFFER_SIZE,
}


class Material(NamedTuple):
    """A compiled material.

    Attributes:
        bundle: what it was made of.
        precision: of its texels on the device.
        shape: of its kernel.
        context: the one it was compiled for.
        queue: where `evaluate` runs.
        kernel: `(count, is_interleaved, wi, wo, f, parameters)`; making one takes longer than a thousand queries.
        lock: held while the kernel's arguments are set, so that threads may share the material.
        parameters: in the device's memory.
    """

    bundle: Bundle
    precision: Precision
    shape: Shape
    context: cl.Context
    queue: cl.CommandQueue
    kernel: cl.Kernel
    lock: threading.Lock
    parameters: cl.Buffer

    @classmethod
    def load(
        cls,
        bundle: Bundle | str | PathLike[str],
        context: cl.Context,
        *,
        precision: Precision | None = None,
        shape: Shape | None = None,
    ) -> Material:
        """The bundle's numbers in the context's memory, and the kernel specialised for what it has.

        Args:
            bundle: or the path of its file.
            context: made by the caller; the kernel is cut for its first device.
            precision: of the texels on the device; by default float16 where that holds every one exactly.
            shape: of the kernel; by default the fastest on this device, found out by a short trial at first use.

        Raises:
            DataError: if the file is not a sound bundle.
            OpenCLError: if the device's compiler or memory refuses.
            ValueError: of a part that kernels do not know, or of texels beyond the precision's range.
        """
        if not isinstance(bundle, Bundle):
            bundle = bundles.load(bundle)
        precision = precision or stored_precision(bundle)
        device = context.devices[0]
        wanted = shape or tuning.best_shape(device)
        built = _build(context, bundle, precision, wanted)
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
        try:
            numbers = cl.Buffer(context, flags, hostbuf=built.numbers)
            queue = cl.CommandQueue(context, device)
        except cl.Error as error:
            raise OpenCLError(f"the parameters do not fit on {describe(device)}: {error}") from None
        kernel = cl.Kernel(built.program, f"{KERNEL}_evaluate")
        # known types are set twenty times faster
        kernel.set_scalar_arg_dtypes([np.uint64, np.uint32, None, None, None, None])
        return cls(bundle, precision, built.shape, context, queue, kernel, threading.Lock(), numbers)

    @property
    def manifest(self) -> Manifest:
        """The bundle's."""
        return self.bundle.manifest

    def evaluate(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        """f(wi, wo) [1/sr], `(..., 3)` in float32: linear Rec.709, no cosine, zero below the horizon, NaN where a
        component is NaN or infinite. Directions that are not of unit length give a finite value without a meaning.

        A batch that the device's memory does not hold is evaluated in parts, with a warning.

        Args:
            wi: unit vectors to the light, `(..., 3)`, local frame.
            wo: unit vectors to the viewer, of the same shape.

        Raises:
            ValueError: if the shapes are not as told.
            OpenCLError: if the device fails.
        """
        wi, wo = np.asarray(wi), np.asarray(wo)
        if wi.shape != wo.shape or wi.shape[-1:] != (3,):
            raise ValueError(f"wi {wi.shape} and wo {wo.shape} must have one shape (..., 3)")
        f = np.empty(wi.shape, np.float32)
        rows = [np.ascontiguousarray(w, np.float32).reshape(-1, 3) for w in (wi, wo)]
        self._evaluate_in_parts(rows[0], rows[1], f.reshape(-1, 3))
        return f

    def enqueue(
        self,
        queue: cl.CommandQueue,
        wi: DeviceArray,
        wo: DeviceArray,
        out: DeviceArray,
        wait_for: Sequence[cl.Event] | None = None,
    ) -> cl.Event:
        """Starts the evaluation of the caller's own arrays, and returns the event of its end. Nothing is copied.

        Args:
            queue: of the material's context.
            wi, wo: `(3, n)` float32, all x before all y before all z: buffers, or pyopencl arrays.
            out: f as `evaluate` gives it, in the same layout; it may not share memory with wi or wo.
            wait_for: events to wait for first.

        Raises:
            ValueError: if an array has the wrong size, dtype or context, or out overlaps another.
            OpenCLError: if the device fails.
        """
        if queue.context != self.context:
            raise ValueError("the queue belongs to another context than the material")
        count = queries_in(self.context, wi, wo, out)
        try:
            return self._enqueue(queue, count, PLANAR, (wi, wo, out), wait_for)
        except cl.Error as error:
            raise OpenCLError(f"{describe(queue.device)} cannot evaluate {count} queries: {error}") from None

    def source(self, entry: str = "material_0") -> str:
        """OpenCL C for a kernel of the caller's own, self-contained.

        It defines `float3 {entry}_eval(float3 wi, float3 wo, __global const float *parameters)`, to be called inline
        with a buffer that holds `inline_parameters()`.

        Sources of several materials may stand in one program, each with its own entry.

        Raises:
            ValueError: if `entry` is not an identifier.
        """
        if not entry.isidentifier():
            raise ValueError(f"entry {entry!r} is not an identifier")
        macros = parameters(self.bundle, INLINE, self.precision).macros
        unroll = is_gpu(self.context.devices[0])
        points = entry_points(self.manifest.model, "inline", macros, prefix=entry)
        return settings(INLINE, self.precision, unroll=unroll) + points

    def inline_parameters(self) -> np.ndarray:
        """The numbers that `source`'s function reads, float32."""
        return parameters(self.bundle, INLINE, self.precision).values

    def _enqueue(
        self,
        queue: cl.CommandQueue,
        count: int,
        layout: int,
        arrays: Sequence[DeviceArray],
        wait_for: Sequence[cl.Event] | None,
    ) -> cl.Event:
        if count == 0:
            return cl.enqueue_marker(queue, wait_for=wait_for)
        buffers = [getattr(array, "data", array) for array in arrays]
        grid, group = self.shape.grid(count), (self.shape.group,)
        with self.lock:
            self.kernel.set_args(count, layout, *buffers, self.parameters)
            return cl.enqueue_nd_range_kernel(queue, self.kernel, grid, group, wait_for=wait_for)

    def _evaluate_in_parts(self, wi: np.ndarray, wo: np.ndarray, f: np.ndarray) -> None:
        start, size = 0, len(f)
        while start < len(f):
            part = slice(start, start + size)
            try:
                self._evaluate_part(wi[part], wo[part], f[part])
                start += size
            except cl.Error as error:
                device = describe(self.queue.device)
                if error.code not in OUT_OF_MEMORY or size == 1:
                    raise OpenCLError(f"{device} cannot evaluate {size} queries: {error}") from None
                size = -(-size // 2)
                warnings.warn(f"{device} has no room for the batch: going on in parts", RuntimeWarning, stacklevel=3)

    def _evaluate_part(self, wi: np.ndarray, wo: np.ndarray, f: np.ndarray) -> None:
        """Interleaved arrays of the host; a processor reads and writes them where they are."""
        flags, shares = cl.mem_flags, not is_gpu(self.queue.device)
        source = flags.READ_ONLY | (flags.USE_HOST_PTR if shares else flags.COPY_HOST_PTR)
        inputs = [cl.Buffer(self.context, source, hostbuf=w) for w in (wi, wo)]
        if not shares:
            output = cl.Buffer(self.context, flags.WRITE_ONLY, f.nbytes)
            event = self._enqueue(self.queue, len(f), INTERLEAVED, (*inputs, output), None)
            cl.enqueue_copy(self.queue, f, output, wait_for=[event])
            return
        output = cl.Buffer(self.context, flags.WRITE_ONLY | flags.USE_HOST_PTR, hostbuf=f)
        event = self._enqueue(self.queue, len(f), INTERLEAVED, (*inputs, output), None)
        # the one wait: each takes as long as some hundred queries
        mapped, done = cl.enqueue_map_buffer(
            self.queue, output, READ, 0, f.shape, f.dtype, wait_for=[event], is_blocking=False
        )
        self.queue.flush()
        if len(f) <= SMALL_BATCH:
            _poll(done)
        done.wait()
        mapped.base.release(self.queue)  # pyright: ignore[reportCallIssue]


def _poll(done: cl.Event) -> None:
    """Asks for the end of a command again and again for a while: sleeping and being woken takes longer than a small
    batch itself."""
    end = time.perf_counter() + POLL_SECONDS
    while done.command_execution_status > cl.command_execution_status.COMPLETE and time.perf_counter() < end:
        pass


class _Built(NamedTuple):
    """A program, the shape that it has, and the numbers that it reads."""

    program: cl.Program
    shape: Shape
    numbers: np.ndarray


def _build(context: cl.Context, bundle: Bundle, precision: Precision, shape: Shape) -> _Built:
    """The program of the shape, or of the next narrower one that the device's compiler takes."""
    macros, numbers = parameters(bundle, shape, precision)
    try:
        return _Built(build(context, _source(bundle, macros, precision, shape, context.devices[0])), shape, numbers)
    except OpenCLError as error:
        smaller = tuning.narrower(shape)
        if smaller is None:
            raise
        warnings.warn(f"width {shape.width}: {error}; trying width {smaller.width}", RuntimeWarning, stacklevel=4)
        return _build(context, bundle, precision, smaller)


def kernel_source(bundle: Bundle, precision: Precision, shape: Shape, device: cl.Device) -> str:
    """The program of the kernel `material_evaluate`."""
    return _source(bundle, parameters(bundle, shape, precision).macros, precision, shape, device)


def _source(bundle: Bundle, macros: dict[str, str], precision: Precision, shape: Shape, device: cl.Device) -> str:
    fits = 4 * int(macros["JB_WEIGHT_COUNT"]) <= device.local_mem_size // 2
    weights = "__local" if is_gpu(device) and fits else "__global"
    points = entry_points(bundle.manifest.model, "evaluate", macros, prefix=KERNEL)
    return settings(shape, precision, weights=weights, unroll=is_gpu(device)) + points
