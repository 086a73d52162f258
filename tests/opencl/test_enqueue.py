"""A program's own buffers, right and wrong."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pyopencl.array
import pytest

from jaxbrdf.errors import OpenCLError
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.platform import context_of
from tests.export.bundles import small_bundle
from tests.opencl.conftest import Device

COUNT = 100
FLAGS = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR


@pytest.fixture(scope="module")
def loaded(opencl: Device) -> Material:
    return Material.load(small_bundle(), opencl.context)


def directions() -> tuple[np.ndarray, np.ndarray]:
    w = np.abs(np.random.default_rng(0).normal(size=(2, COUNT, 3)))
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True)).astype(np.float32)
    return wi, wo


def planar(w: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(w.T)


def buffers(context: cl.Context) -> list[cl.Buffer]:
    """wi, wo and out."""
    wi, wo = directions()
    return [cl.Buffer(context, FLAGS, hostbuf=planar(w)) for w in (wi, wo, np.zeros_like(wi))]


def test_buffers_and_arrays_give_what_evaluate_gives(opencl: Device, loaded: Material):
    wi, wo, out = buffers(opencl.context)
    loaded.enqueue(opencl.queue, wi, wo, out).wait()
    found = np.empty((3, COUNT), np.float32)
    cl.enqueue_copy(opencl.queue, found, out)
    np.testing.assert_array_equal(found.T, loaded.evaluate(*directions()))
    arrays = [cl.array.to_device(opencl.queue, planar(w)) for w in directions()]
    result = cl.array.zeros(opencl.queue, (3, COUNT), np.float32)
    loaded.enqueue(opencl.queue, *arrays, result).wait()
    np.testing.assert_array_equal(result.get(), found)


def test_it_waits_for_what_it_is_told_to(opencl: Device, loaded: Material):
    wi, wo, out = buffers(opencl.context)
    gate = cl.UserEvent(opencl.context)
    event = loaded.enqueue(opencl.queue, wi, wo, out, [gate])
    opencl.queue.flush()
    assert event.command_execution_status != cl.command_execution_status.COMPLETE
    gate.set_status(cl.command_execution_status.COMPLETE)
    event.wait()
    assert event.command_execution_status == cl.command_execution_status.COMPLETE


def test_parts_of_one_buffer_are_apart(opencl: Device, loaded: Material):
    wi, wo = directions()
    step = max(opencl.device.mem_base_addr_align // 8, 1)
    stride = -(-12 * COUNT // step) * step
    whole = cl.Buffer(opencl.context, cl.mem_flags.READ_WRITE, 3 * stride)
    first, second, out = (whole.get_sub_region(k * stride, 12 * COUNT) for k in range(3))
    for part, w in ((first, wi), (second, wo)):
        cl.enqueue_copy(opencl.queue, part, planar(w))
    loaded.enqueue(opencl.queue, first, second, out).wait()
    found = np.empty((3, COUNT), np.float32)
    cl.enqueue_copy(opencl.queue, found, out)
    np.testing.assert_array_equal(found.T, loaded.evaluate(wi, wo))
    with pytest.raises(ValueError, match="out overlaps wo"):
        loaded.enqueue(opencl.queue, first, second, second)
    with pytest.raises(ValueError, match="out overlaps wi"):
        loaded.enqueue(opencl.queue, whole.get_sub_region(0, 12 * COUNT), second, first)


def test_wrong_arrays_are_named(opencl: Device, loaded: Material):
    wi, wo, out = buffers(opencl.context)
    short = cl.Buffer(opencl.context, cl.mem_flags.READ_WRITE, 12 * COUNT - 4)
    with pytest.raises(ValueError, match="each must have 3 n floats"):
        loaded.enqueue(opencl.queue, wi, wo, short)
    with pytest.raises(ValueError, match="each must have 3 n floats"):
        loaded.enqueue(opencl.queue, short, short, cl.Buffer(opencl.context, FLAGS, hostbuf=np.zeros(299, np.float32)))
    with pytest.raises(ValueError, match="out overlaps wi"):
        loaded.enqueue(opencl.queue, wi, wo, wi)
    with pytest.raises(ValueError, match="wi is a ndarray, not a buffer"):
        loaded.enqueue(opencl.queue, directions()[0], wo, out)
    double = cl.array.zeros(opencl.queue, (3, COUNT), np.float64)
    with pytest.raises(ValueError, match="wo is float64, not float32"):
        loaded.enqueue(opencl.queue, wi, double, out)
    interleaved = cl.array.zeros(opencl.queue, (COUNT, 3), np.float32)
    with pytest.raises(ValueError, match=r"out of shape \(100, 3\) is not a contiguous \(3, n\)"):
        loaded.enqueue(opencl.queue, wi, wo, interleaved)
    with pytest.raises(ValueError, match="begins 24 bytes inside its buffer"):
        loaded.enqueue(opencl.queue, cl.array.zeros(opencl.queue, (4, 6), np.float32)[1:], wo, out)


def test_another_context_is_refused(opencl: Device, loaded: Material):
    other = context_of(opencl.device)
    wi, _, out = buffers(opencl.context)
    foreign = buffers(other)
    with pytest.raises(ValueError, match="wo belongs to another context than the material"):
        loaded.enqueue(opencl.queue, wi, foreign[1], out)
    with pytest.raises(ValueError, match="the queue belongs to another context"):
        loaded.enqueue(cl.CommandQueue(other), *foreign)


class Lost(cl.RuntimeError):
    """What pyopencl raises, with a code of our choice."""

    code = cl.status_code.DEVICE_NOT_AVAILABLE


def test_a_device_lost_in_the_middle_is_one_error(opencl: Device, loaded: Material, monkeypatch: pytest.MonkeyPatch):
    def lost(*_: object, **__: object) -> None:
        raise Lost("clEnqueueNDRangeKernel failed: DEVICE_NOT_AVAILABLE")

    monkeypatch.setattr(cl, "enqueue_nd_range_kernel", lost)
    with pytest.raises(OpenCLError, match="cannot evaluate 100 queries"):
        loaded.evaluate(*directions())
    with pytest.raises(OpenCLError, match="cannot evaluate 100 queries"):
        loaded.enqueue(opencl.queue, *buffers(opencl.context))
