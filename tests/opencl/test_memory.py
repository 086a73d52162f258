"""What a material leaves behind, and what it does where memory is short."""

from __future__ import annotations

import gc
import resource

import numpy as np
import pyopencl as cl
import pytest

from jaxbrdf.errors import OpenCLError
from jaxbrdf.opencl import Material
from jaxbrdf.opencl.shape import Shape
from tests.export.bundles import small_bundle
from tests.opencl.conftest import Device

SHAPE = Shape(4, 4)


def directions(count: int) -> np.ndarray:
    w = np.abs(np.random.default_rng(0).normal(size=(2, count, 3)))
    return (w / np.linalg.norm(w, axis=-1, keepdims=True)).astype(np.float32)


def resident_megabytes() -> float:
    """Of this process now."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 2**20


def test_a_thousand_materials_made_and_dropped_leave_nothing(opencl: Device):
    wi, wo = directions(16)
    bundle = small_bundle()

    def make(count: int) -> None:
        for _ in range(count):
            Material.load(bundle, opencl.context, shape=SHAPE).evaluate(wi, wo)
        gc.collect()

    # a driver fills its pools first
    make(100)
    before = resident_megabytes()
    make(1000)
    assert resident_megabytes() - before < 20


class NoRoom(cl.MemoryError):
    """What pyopencl raises where a buffer does not fit."""

    code = cl.status_code.MEM_OBJECT_ALLOCATION_FAILURE


def test_a_batch_without_room_is_split_and_that_is_told(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    loaded = Material.load(small_bundle(), opencl.context)
    wi, wo = directions(1000)
    wanted = loaded.evaluate(wi, wo)
    evaluate = Material._evaluate_part
    sizes = []

    def small(self: Material, rows: list[np.ndarray], f: np.ndarray) -> None:
        if len(f) > 300:
            raise NoRoom("clCreateBuffer failed: MEM_OBJECT_ALLOCATION_FAILURE")
        sizes.append(len(f))
        evaluate(self, rows, f)

    monkeypatch.setattr(Material, "_evaluate_part", small)
    with pytest.warns(RuntimeWarning, match="has no room for the batch: going on in parts") as told:
        np.testing.assert_array_equal(loaded.evaluate(wi, wo), wanted)
    assert sizes == [250, 250, 250, 250]
    assert len({str(one.message) for one in told}) == 1


def test_a_device_without_room_for_one_query_fails(opencl: Device, monkeypatch: pytest.MonkeyPatch):
    def none(*_: object) -> None:
        raise NoRoom("clCreateBuffer failed: MEM_OBJECT_ALLOCATION_FAILURE")

    loaded = Material.load(small_bundle(), opencl.context)
    monkeypatch.setattr(Material, "_evaluate_part", none)
    with pytest.warns(RuntimeWarning), pytest.raises(OpenCLError, match="cannot evaluate 1 queries"):
        loaded.evaluate(*directions(3))
