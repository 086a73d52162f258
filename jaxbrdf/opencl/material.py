"""A bundle on a device, and its evaluation for batches of direction pairs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pyopencl as cl

from jaxbrdf.errors import OpenCLError
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.manifest import Manifest
from jaxbrdf.opencl.arguments import Argument, arguments
from jaxbrdf.opencl.program import build, model_source

GROUP = 64
"""The number of work items is a multiple of it, so that any number of queries has groups of a good size."""


class DeviceMaterial(NamedTuple):
    """A compiled material.

    Attributes:
        manifest: the bundle's.
        context: the one it was compiled for.
        program: its kernel `evaluate(count, wi, wo, f, *buffers)`.
        buffers: the parameters in the device's memory.
    """

    manifest: Manifest
    context: cl.Context
    program: cl.Program
    buffers: tuple[cl.Buffer, ...]


def load(bundle: Bundle, context: cl.Context) -> DeviceMaterial:
    """The bundle's parameters in the context's memory and the kernel specialised for its sizes.

    Raises:
        OpenCLError: if the device's compiler or memory refuses.
    """
    parts = arguments(bundle)
    room = min(device.max_constant_buffer_size for device in context.devices)
    program = build(context, model_source(bundle.manifest.model), _constants(bundle, parts, room))
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    try:
        buffers = tuple(cl.Buffer(context, flags, hostbuf=part.values) for part in parts)
    except cl.Error as error:
        raise OpenCLError(f"the parameters do not fit on the device: {error}") from None
    return DeviceMaterial(bundle.manifest, context, program, buffers)


def evaluate(material: DeviceMaterial, queue: cl.CommandQueue, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f(wi, wo) [1/sr], `(..., 3)` in float32: linear Rec.709, no cosine, zero below the horizon.

    Args:
        material: on the queue's context.
        queue: where it runs; the call returns when the values are there.
        wi: unit vectors to the light, `(..., 3)`, local frame.
        wo: unit vectors to the viewer, of the same shape.

    Raises:
        ValueError: if the shapes are not as told.
        OpenCLError: if the device fails, as when its memory is too small for the batch.
    """
    if wi.shape != wo.shape or wi.shape[-1:] != (3,):
        raise ValueError(f"wi {wi.shape} and wo {wo.shape} must have one shape (..., 3)")
    f = np.empty(wi.shape, np.float32)
    if f.size:
        try:
            _run(material, queue, np.ascontiguousarray(wi, np.float32), np.ascontiguousarray(wo, np.float32), f)
        except cl.Error as error:
            raise OpenCLError(f"the device cannot evaluate {f.size // 3} queries: {error}") from None
    return f


def _run(material: DeviceMaterial, queue: cl.CommandQueue, wi: np.ndarray, wo: np.ndarray, f: np.ndarray) -> None:
    count = f.size // 3
    inputs = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    wi_buffer, wo_buffer = (cl.Buffer(material.context, inputs, hostbuf=w) for w in (wi, wo))
    f_buffer = cl.Buffer(material.context, cl.mem_flags.WRITE_ONLY, f.nbytes)
    kernel = cl.Kernel(material.program, "evaluate")
    kernel.set_args(np.uint64(count), wi_buffer, wo_buffer, f_buffer, *material.buffers)
    cl.enqueue_nd_range_kernel(queue, kernel, (-(-count // GROUP) * GROUP,), None)
    cl.enqueue_copy(queue, f, f_buffer, is_blocking=True)


def _constants(bundle: Bundle, parts: list[Argument], room: int) -> dict[str, str]:
    """Macros of a device with `room` bytes of constant memory."""
    sizes = {name: value for part in parts for name, value in part.constants.items()}
    weights = sum(part.values.nbytes for part in parts if part.is_weight)
    variants = {"ISOTROPIC": bundle.manifest.isotropic, "WEIGHTS_OUTGROW_CONSTANT_MEMORY": weights > room}
    return sizes | {name: "" for name, holds in variants.items() if holds}
