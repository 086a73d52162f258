from __future__ import annotations

import numpy as np
import pytest

from jaxbrdf.opencl import Material
from tests.export.bundles import random_bundle, small_bundle
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


@pytest.mark.parametrize("variant", ["gated horizon", "nbrdf isotropic", "naive-mlp isotropic"])
def test_a_direction_that_is_no_number_stays_visible(opencl: Device, variant: str):
    bad = np.array([[np.nan, 0, 1], [np.inf, 0, 1], [np.nan] * 3, [0, 1, -np.nan], [np.inf, 0, np.inf]], np.float32)
    good = np.array([[0, 0, 1], [0.6, 0, 0.8], [0, 0.6, -0.8]], np.float32)
    bad, good = np.repeat(bad, len(good), axis=0), np.tile(good, (len(bad), 1))
    loaded = Material.load(random_bundle(variant), opencl.context)
    assert np.isnan(loaded.evaluate(bad, good)).all()
    assert np.isnan(loaded.evaluate(good, bad)).all()


@pytest.mark.parametrize("scale", [0.0, 1e-20, 1e-3, 0.99, 3.0, 1e12])
def test_a_direction_that_is_not_of_unit_length_gives_a_number(opencl: Device, loaded: Material, scale: float):
    wi, wo = directions((64,)), directions((64, 1))[..., 0, :]
    assert np.isfinite(loaded.evaluate(np.float32(scale) * wi, wo)).all()
    assert np.isfinite(loaded.evaluate(np.float32(scale) * wi, np.float32(scale) * wo)).all()
