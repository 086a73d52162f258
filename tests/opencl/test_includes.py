"""Each helper of kernels_cl/include alone, against float64 written another way."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.special import expit

from tests.opencl.conftest import Device
from tests.opencl.kernels import run

COUNT = 512

# so that a test's buffers, which are global, can be handed to functions over weights
GLOBAL = {"WEIGHTS_OUTGROW_CONSTANT_MEMORY": ""}


def directions(seed: int) -> np.ndarray:
    """Unit vectors on the upper hemisphere, rounded to float32, some close to the pole and some to the horizon."""
    rng = np.random.default_rng(seed)
    w = rng.normal(size=(COUNT, 3)) * [1, 1, 1]
    w[: COUNT // 4, :2] *= 10.0 ** rng.uniform(-8, 0, (COUNT // 4, 1))
    w[-COUNT // 4 :, 2:] *= 10.0 ** rng.uniform(-6, 0, (COUNT // 4, 1))
    w[:, 2] = np.abs(w[:, 2])
    return (w / np.linalg.norm(w, axis=1, keepdims=True)).astype(np.float32)


def rotation_to_normal(wh: np.ndarray) -> np.ndarray:
    """The matrix Ry(-theta) Rz(-phi) that takes wh to the normal, in float64."""
    theta, phi = np.arctan2(np.hypot(wh[0], wh[1]), wh[2]), np.arctan2(wh[1], wh[0])
    c, s = np.cos(phi), np.sin(phi)
    about_z = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ about_z


def half_difference(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Rusinkiewicz's wh and wd by rotation matrices, `(n, 6)`; wd as half the turned difference of the unit vectors."""
    wi, wo = (w.astype(np.float64) for w in (wi, wo))
    wh = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
    turned = [rotation_to_normal(h) @ np.stack([a - b, a + b], axis=1) / 2 for h, a, b in zip(wh, wi, wo, strict=True)]
    return np.array([[*h, t[0, 0], t[1, 0], t[2, 1]] for h, t in zip(wh, turned, strict=True)])


@pytest.mark.parametrize("distance", [1.0, 1e-2, 1e-4, 1e-6])
def test_half_and_difference_keep_their_digits(opencl: Device, distance: float):
    wo = directions(1).astype(np.float64)
    wi = wo + distance * np.random.default_rng(2).normal(size=wo.shape)
    wi = (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32)
    wo = wo.astype(np.float32)
    body = """const HalfDifference at = half_difference(vload3(i, wi), vload3(i, wo));
        vstore3(at.wh, 0, out); vstore3(at.wd, 1, out);"""
    found = run(opencl, ["directions"], body, {"wi": wi, "wo": wo}, 6)
    wanted = half_difference(wi, wo)
    np.testing.assert_allclose(found[:, :3], wanted[:, :3], atol=3e-7)
    # not only absolutely: a radial warp magnifies what is near the pole
    radius = np.linalg.norm(wanted[:, 3:5], axis=1)
    met = radius == 0
    assert np.abs(found[:, 3:5] - wanted[:, 3:5])[met].max(initial=0.0) == 0.0
    assert (np.linalg.norm(found[:, 3:5] - wanted[:, 3:5], axis=1)[~met] / radius[~met]).max() < 1e-6
    np.testing.assert_allclose(found[:, 5], wanted[:, 5], atol=3e-7)


def test_half_vector_of_opposed_directions_is_the_normal(opencl: Device):
    w = directions(3)
    body = "const HalfDifference at = half_difference(vload3(i, w), -vload3(i, w)); vstore3(at.wh, 0, out);"
    np.testing.assert_array_equal(run(opencl, ["directions"], body, {"w": w}, 3), np.tile([0, 0, 1], (COUNT, 1)))


def test_turning_back_leaves_no_azimuth(opencl: Device):
    w = directions(4)
    body = "const float3 t = vload3(i, w); vstore3(turn_back(azimuth_of(t), t), 0, out); out[3] = sin_theta(t);"
    found = run(opencl, ["directions"], body, {"w": w}, 4)
    sine = np.hypot(*w[:, :2].T.astype(np.float64))
    np.testing.assert_allclose(found[:, 0], sine, rtol=5e-7)
    np.testing.assert_allclose(found[:, 3], sine, rtol=5e-7)
    assert (np.abs(found[:, 1]) <= 2e-7 * sine).all()
    np.testing.assert_array_equal(found[:, 2], w[:, 2])


@pytest.mark.parametrize("period", [np.pi, 2 * np.pi])
def test_turn_is_the_share_of_the_period(opencl: Device, period: float):
    angles = np.concatenate([np.linspace(-np.pi, np.pi, COUNT - 3), [1e-30, -1e-30, -1e-8]])
    w = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1).astype(np.float32)
    w[::2] *= np.float32(1e-6)
    found = run(opencl, ["polar"], f"out[0] = disk_turn(vload3(i, w), {period}f);", {"w": w}, 1)[:, 0]
    assert ((found >= 0) & (found < 1)).all()
    wanted = np.arctan2(w[:, 1].astype(np.float64), w[:, 0]) / period
    away = np.abs(found - wanted + np.rint(wanted - found))
    assert away.max() < 3e-7


def test_turn_at_the_pole_is_zero(opencl: Device):
    w = np.array([[0, 0, 1], [-0.0, 0, 1], [0, -0.0, 1], [-0.0, -0.0, 1]])
    np.testing.assert_array_equal(run(opencl, ["polar"], "out[0] = disk_turn(vload3(i, w), 3.14f);", {"w": w}, 1), 0)


def test_radial_warp(opencl: Device):
    r = np.concatenate([[0.0, 1.0], 10.0 ** np.random.default_rng(5).uniform(-12, 0, COUNT)]).astype(np.float32)
    shares, exponents = np.array([0.2, 0.5, 0.3]), np.array([0.5, 1.3, 4.0])
    terms = np.tile(np.concatenate([shares, exponents]), (len(r), 1))
    body = "out[0] = radial_warp(terms, 3, r[i]);"
    found = run(opencl, ["polar"], body, {"r": r, "terms": terms}, 1, constants=GLOBAL)[:, 0]
    wanted = (shares * r.astype(np.float64)[:, None] ** exponents).sum(axis=1)
    np.testing.assert_allclose(found, wanted, rtol=5e-6, atol=1e-18)


def test_angular_fetch(opencl: Device):
    channels, n_r, n_phi = 3, 5, 7
    rng = np.random.default_rng(6)
    texture = rng.normal(size=(channels, n_r, n_phi)).astype(np.float32)
    texture[:, 0] = texture[:, 0, :1]
    r = np.concatenate([[0, 1, 1, 0.25, 1.0000001, -1e-9], rng.uniform(size=COUNT)]).astype(np.float32)
    turn = np.concatenate([[0, 0, 0.99999994, 6 / 7, 0.5, 0.5], rng.uniform(size=COUNT)]).astype(np.float32)
    inputs = {"r": r, "turn": turn, "texture": np.moveaxis(texture, 0, -1)}
    body = f"angular_fetch(texture, {n_r}, {n_phi}, {channels}, r[i], turn[i], out);"
    found = run(opencl, ["angular"], body, inputs, channels)
    wrapped = np.concatenate([texture, texture[:, :, :1]], axis=2).astype(np.float64)
    places = np.stack([np.clip(r, 0, 1) * (n_r - 1), turn.astype(np.float64) * n_phi])
    wanted = np.stack([map_coordinates(channel, places, order=1) for channel in wrapped], axis=-1)
    np.testing.assert_allclose(found, wanted, atol=5e-6)


def test_radial_fetch(opencl: Device):
    texture = np.random.default_rng(7).normal(size=(4, 2)).astype(np.float32)
    r = np.linspace(0, 1, COUNT).astype(np.float32)
    found = run(opencl, ["angular"], "radial_fetch(texture, 4, 2, r[i], out);", {"r": r, "texture": texture}, 2)
    wanted = [np.interp(r, np.linspace(0, 1, 4), column) for column in texture.T.astype(np.float64)]
    np.testing.assert_allclose(found, np.stack(wanted, axis=-1), atol=2e-6)


@pytest.mark.parametrize("widths", [(4, 3), (2, 5, 3), (6, 3, 9, 4, 3)])
def test_mlp(opencl: Device, widths: tuple[int, ...]):
    rng = np.random.default_rng(8)
    layers = [(rng.normal(size=(a, b)), rng.normal(size=b)) for a, b in pairwise(widths)]
    x = rng.normal(size=(COUNT, widths[0]))
    sizes = {"LAYERS": len(layers), "WIDTHS": ",".join(map(str, widths)), "WIDEST": max(widths)}
    constants = GLOBAL | {f"MLP_{name}": str(value) for name, value in sizes.items()}
    parameters = np.concatenate([part.ravel() for layer in layers for part in layer])
    body = f"for (int k = 0; k < {widths[0]}; ++k) out[k] = x[i * {widths[0]} + k]; mlp_apply(parameters, out);"
    found = run(opencl, ["mlp"], body, {"x": x, "parameters": parameters}, max(widths), constants=constants)
    value = x
    for weight, bias in layers[:-1]:
        value = (value @ weight + bias) * expit(value @ weight + bias)
    value = value @ layers[-1][0] + layers[-1][1]
    np.testing.assert_allclose(found[:, : widths[-1]], value, atol=2e-5)


def test_silu_has_its_limits(opencl: Device):
    x = np.array([-1e4, -100, -88, -20, -1, 0, 1, 20, 1e4], np.float32)
    constants = {"MLP_LAYERS": "1", "MLP_WIDTHS": "1,1", "MLP_WIDEST": "1"}
    found = run(opencl, ["mlp"], "out[0] = silu(x[i]);", {"x": x}, 1, constants=constants)[:, 0]
    np.testing.assert_allclose(found, x * expit(x.astype(np.float64)), rtol=1e-6, atol=1e-36)


def test_reflectance_is_bounded_and_does_not_hide_a_nan(opencl: Device):
    log_f = np.array([[-200, -20, 0], [5, 80, 81], [1e30, np.nan, np.inf]], np.float32)
    body = "const float x[3] = {l[3 * i], l[3 * i + 1], l[3 * i + 2]}; vstore3(reflectance(x), 0, out);"
    found = run(opencl, ["output"], body, {"l": log_f}, 3)
    np.testing.assert_allclose(found, np.exp(np.minimum(log_f.astype(np.float64), 80)), rtol=2e-6, atol=1e-37)
