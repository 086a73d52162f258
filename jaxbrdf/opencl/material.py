"""A material on a device: its kernel, its numbers, and their evaluation for batches of direction pairs."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Sequence
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
import pyopencl as cl

from jaxbrdf.errors import OpenCLError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle, Precision
from jaxbrdf.export.manifest import Manifest
from jaxbrdf.opencl import tuning
from jaxbrdf.opencl.arrays import DeviceArray, check_place, queries_in, rows_of
from jaxbrdf.opencl.parameters import parameters, stored_precision
from jaxbrdf.opencl.platform import describe, is_gpu
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import INLINE, Shape
from jaxbrdf.opencl.source import entry_points, settings

KERNEL = "material"
POINTS = "points"
"""Prefix of the kernel that takes places for points, of a material over a surface."""

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
        kernel: `(count, is_interleaved, wi, wo, f, parameters)`, of a material over a surface with uv and footprint
            before f; making one takes longer than a thousand queries.
        lock: held while a kernel's arguments are set, so that threads may share the material.
        parameters: in the device's memory.
        point_kernel: the same without footprint, of a material over a surface.
    """

    bundle: Bundle
    precision: Precision
    shape: Shape
    context: cl.Context
    queue: cl.CommandQueue
    kernel: cl.Kernel
    lock: threading.Lock
    parameters: cl.Buffer
    point_kernel: cl.Kernel | None = None

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
        is_spatial = bundle.manifest.is_spatial
        kernel = _kernel(built.program, KERNEL, arrays=5 if is_spatial else 3)
        at_points = _kernel(built.program, POINTS, arrays=4) if is_spatial else None
        return cls(bundle, precision, built.shape, context, queue, kernel, threading.Lock(), numbers, at_points)

    @property
    def manifest(self) -> Manifest:
        """The bundle's."""
        return self.bundle.manifest

    def evaluate(
        self, wi: np.ndarray, wo: np.ndarray, *, uv: np.ndarray | None = None, footprint: np.ndarray | None = None
    ) -> np.ndarray:
        """f(wi, wo) [1/sr], `(..., 3)` in float32: linear Rec.709, no cosine, zero below the horizon, NaN where a
        component is NaN or infinite. Directions that are not of unit length give a finite value without a meaning.

        A batch that the device's memory does not hold is evaluated in parts, with a warning.

        Args:
            wi: unit vectors to the light, `(..., 3)`, local frame.
            wo: unit vectors to the viewer, of the same shape.
            uv: texture coordinates `(..., 2)`, of a material that varies over a surface.
            footprint: `(..., 2, 2)`, takes the unit filter to uv; None for points, which are not filtered.

        Raises:
            ValueError: if the shapes are not as told, or uv is missing or there is no use for it.
            OpenCLError: if the device fails.
        """
        check_place(self.manifest.is_spatial, uv, footprint)
        rows = rows_of({name: np.asarray(array) for name, array in _given(wi, wo, uv, footprint).items()})
        f = np.empty(np.shape(wi), np.float32)
        self._evaluate_in_parts(rows, f.reshape(-1, 3))
        return f

    def enqueue(
        self,
        queue: cl.CommandQueue,
        wi: DeviceArray,
        wo: DeviceArray,
        out: DeviceArray,
        wait_for: Sequence[cl.Event] | None = None,
        *,
        uv: DeviceArray | None = None,
        footprint: DeviceArray | None = None,
    ) -> cl.Event:
        """Starts the evaluation of the caller's own arrays, and returns the event of its end. Nothing is copied.

        Args:
            queue: of the material's context.
            wi, wo: `(3, n)` float32, all x before all y before all z: buffers, or pyopencl arrays.
            out: f as `evaluate` gives it, in the same layout; it may not share memory with wi or wo.
            wait_for: events to wait for first.
            uv: `(2, n)` float32, of a material that varies over a surface.
            footprint: `(4, n)` float32, the matrices row by row; None for points.

        Raises:
            ValueError: if an array has the wrong size, dtype or context, or out overlaps another, or uv is missing or
                there is no use for it.
            OpenCLError: if the device fails.
        """
        if queue.context != self.context:
            raise ValueError("the queue belongs to another context than the material")
        check_place(self.manifest.is_spatial, uv, footprint)
        arrays = {**_given(wi, wo, uv, footprint), "out": out}
        count = queries_in(self.context, arrays)
        try:
            return self._enqueue(queue, count, PLANAR, list(arrays.values()), wait_for)
        except cl.Error as error:
            raise OpenCLError(f"{describe(queue.device)} cannot evaluate {count} queries: {error}") from None

    def source(self, entry: str = "material_0") -> str:
        """OpenCL C for a kernel of the caller's own, self-contained.

        It defines `float3 {entry}_eval(float3 wi, float3 wo, __global const float *parameters)`, to be called inline
        with a buffer that holds `inline_parameters()`. Of a material that varies over a surface the arguments are
        `(float3 wi, float3 wo, float2 uv, float4 footprint, __global const float *parameters)`, the footprint's matrix
        row by row, zero for a point.

        Sources of several materials may stand in one program, each with its own entry.

        Raises:
            ValueError: if `entry` is not an identifier.
        """
        if not entry.isidentifier():
            raise ValueError(f"entry {entry!r} is not an identifier")
        macros = parameters(self.bundle, INLINE, self.precision).macros
        unroll = is_gpu(self.context.devices[0])
        name = "inline_surface" if self.manifest.is_spatial else "inline"
        points = entry_points(self.manifest.model, name, macros, prefix=entry)
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
        # uv, but no footprint
        kernel = self.point_kernel if self.point_kernel is not None and len(buffers) == 4 else self.kernel
        with self.lock:
            kernel.set_args(count, layout, *buffers, self.parameters)
            return cl.enqueue_nd_range_kernel(queue, kernel, grid, group, wait_for=wait_for)

    def _evaluate_in_parts(self, rows: Sequence[np.ndarray], f: np.ndarray) -> None:
        start, size = 0, len(f)
        while start < len(f):
            part = slice(start, start + size)
            try:
                self._evaluate_part([given[part] for given in rows], f[part])
                start += size
            except cl.Error as error:
                device = describe(self.queue.device)
                if error.code not in OUT_OF_MEMORY or size == 1:
                    raise OpenCLError(f"{device} cannot evaluate {size} queries: {error}") from None
                size = -(-size // 2)
                warnings.warn(f"{device} has no room for the batch: going on in parts", RuntimeWarning, stacklevel=3)

    def _evaluate_part(self, rows: Sequence[np.ndarray], f: np.ndarray) -> None:
        """Interleaved arrays of the host; a processor reads and writes them where they are."""
        flags, shares = cl.mem_flags, not is_gpu(self.queue.device)
        source = flags.READ_ONLY | (flags.USE_HOST_PTR if shares else flags.COPY_HOST_PTR)
        inputs = [cl.Buffer(self.context, source, hostbuf=given) for given in rows]
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


def _given(wi: Any, wo: Any, uv: Any, footprint: Any) -> dict[str, Any]:
    """The inputs that there are, in the order of the kernel's arguments."""
    named = {"wi": wi, "wo": wo, "uv": uv, "footprint": footprint}
    return {name: array for name, array in named.items() if array is not None}


def _kernel(program: cl.Program, prefix: str, *, arrays: int) -> cl.Kernel:
    kernel = cl.Kernel(program, f"{prefix}_evaluate")
    # known types are set twenty times faster
    kernel.set_scalar_arg_dtypes([np.uint64, np.uint32, *[None] * arrays, None])
    return kernel


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
    """The program of the kernel `material_evaluate`, and of a material over a surface of `points_evaluate`."""
    return _source(bundle, parameters(bundle, shape, precision).macros, precision, shape, device)


def _source(bundle: Bundle, macros: dict[str, str], precision: Precision, shape: Shape, device: cl.Device) -> str:
    fits = 0 < 4 * int(macros["JB_WEIGHT_COUNT"]) <= device.local_mem_size // 2
    weights = "__local" if is_gpu(device) and fits else "__global"
    model = bundle.manifest.model
    if bundle.manifest.is_spatial:
        filtered = entry_points(model, "surface", macros, prefix=KERNEL)
        unfiltered = {name: value for name, value in macros.items() if name != "JB_PROBES"}
        points = filtered + entry_points(model, "surface", unfiltered, prefix=POINTS)
    else:
        points = entry_points(model, "evaluate", macros, prefix=KERNEL)
    return settings(shape, precision, weights=weights, unroll=is_gpu(device)) + points
