from __future__ import annotations

import numpy as np
import pytest

from jaxbrdf.opencl import Material
from tests.export.bundles import small_bundle
from tests.opencl.conftest import Device


@pytest.fixture(scope="module")
def loaded(opencl: Device) -> Material:
    return Material.load(small_bundle(), opencl.context)


def directions(shape: tuple[int, ...]) -> np.ndarray:
    w = np.abs(np.random.default_rng(len(shape)).normal(size=(*shape, 3)))
    return (w / np.linalg.norm(w, axis=-1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("shape", [(), (1,), (63,), (64,), (65,), (5, 13), (2, 3, 4)])
def test_any_batch_shape_gives_each_querys_own_value(loaded: Material, shape: tuple[int, ...]):
    wi, wo = directions(shape), directions((*shape, 1))[..., 0, :]
    f = loaded.evaluate(wi, wo)
    assert f.shape == wi.shape
    assert f.dtype == np.float32
    one_by_one = [loaded.evaluate(a, b) for a, b in zip(wi.reshape(-1, 3), wo.reshape(-1, 3), strict=True)]
    np.testing.assert_array_equal(f.reshape(-1, 3), one_by_one)


def test_no_query_gives_no_value(loaded: Material):
    nothing = np.zeros((0, 3), np.float32)
    assert loaded.evaluate(nothing, nothing).shape == (0, 3)


def test_other_layouts_are_taken(loaded: Material):
    w = directions((64,))
    wanted = loaded.evaluate(w[::2], w[1::2])
    np.testing.assert_array_equal(loaded.evaluate(np.asfortranarray(w[::2]), w[1::2].astype(np.float64)), wanted)


@pytest.mark.parametrize(("wi", "wo"), [((4, 3), (5, 3)), ((4, 2), (4, 2)), ((3,), (1, 3)), ((), ())])
def test_wrong_shapes_are_refused(loaded: Material, wi: tuple[int, ...], wo: tuple[int, ...]):
    with pytest.raises(ValueError, match=r"must have one shape \(\.\.\., 3\)"):
        loaded.evaluate(np.zeros(wi), np.zeros(wo))


def test_directions_that_are_not_finite_do_not_read_outside(loaded: Material):
    bad = np.array(
        [[np.nan, 0, 1], [np.inf, 0, 1], [np.nan] * 3, [1e38, 1e38, 1e38], [np.inf, np.nan, np.inf]], np.float32
    )
    wi, wo = np.repeat(bad, len(bad), axis=0), np.tile(bad, (len(bad), 1))
    assert loaded.evaluate(wi, wo).shape == (25, 3)
