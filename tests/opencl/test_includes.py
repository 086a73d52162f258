"""Each helper of kernels_cl/include alone, against float64 written another way."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pytest
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation
from scipy.special import expit

from jaxbrdf.opencl import network
from jaxbrdf.opencl.parameters import network as network_parameters
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.opencl.source import helpers, settings
from tests.opencl.conftest import Device
from tests.opencl.kernels import SHAPES, run

COUNT = 512

every_shape = pytest.mark.parametrize("shape", SHAPES, ids=str)
narrowest_and_widest = pytest.mark.parametrize("shape", SHAPES[::3], ids=str)

WI_WO = "const jb_real3 wi = {wi_0, wi_1, wi_2}, wo = {wo_0, wo_1, wo_2};"
W = "const jb_real3 w = {w_0, w_1, w_2};"


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
@narrowest_and_widest
def test_half_and_difference_keep_their_digits(opencl: Device, shape: Shape, distance: float):
    wo = directions(1).astype(np.float64)
    wi = wo + distance * np.random.default_rng(2).normal(size=wo.shape)
    wi = (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32)
    wo = wo.astype(np.float32)
    body = f"""{WI_WO} const jb_HalfDifference at = jb_half_difference(wi, wo);
        out[0] = at.wh.x; out[1] = at.wh.y; out[2] = at.wh.z; out[3] = at.wd.x; out[4] = at.wd.y; out[5] = at.wd.z;"""
    found = run(opencl, ["directions"], body, {"wi": wi, "wo": wo}, 6, shape=shape)
    wanted = half_difference(wi, wo)
    np.testing.assert_allclose(found[:, :3], wanted[:, :3], atol=3e-7)
    # not only absolutely: a radial warp magnifies what is near the pole
    radius = np.linalg.norm(wanted[:, 3:5], axis=1)
    met = radius == 0
    assert np.abs(found[:, 3:5] - wanted[:, 3:5])[met].max(initial=0.0) == 0.0
    assert (np.linalg.norm(found[:, 3:5] - wanted[:, 3:5], axis=1)[~met] / radius[~met]).max() < 1e-6
    np.testing.assert_allclose(found[:, 5], wanted[:, 5], atol=3e-7)


@narrowest_and_widest
def test_half_vector_of_opposed_directions_is_the_normal(opencl: Device, shape: Shape):
    w = directions(3)
    body = f"""{W} const jb_real3 opposed = {{-w.x, -w.y, -w.z}};
        const jb_real3 wh = jb_half_difference(w, opposed).wh; out[0] = wh.x; out[1] = wh.y; out[2] = wh.z;"""
    found = run(opencl, ["directions"], body, {"w": w}, 3, shape=shape)
    np.testing.assert_array_equal(found, np.tile([0, 0, 1], (COUNT, 1)))


@narrowest_and_widest
def test_half_vector_of_almost_opposed_directions_keeps_its_digits(opencl: Device, shape: Shape):
    """Along the horizon, where the sum is as short as 1e-24."""
    rng = np.random.default_rng(10)
    short = 10.0 ** rng.uniform(-24, -3, (COUNT, 1)) * rng.normal(size=(COUNT, 2))
    wi = np.concatenate([np.ones((COUNT, 1)), short], axis=1).astype(np.float32)
    wo = np.concatenate([-np.ones((COUNT, 1)), 0.3 * short], axis=1).astype(np.float32)
    body = f"""{WI_WO} const jb_real3 wh = jb_half_difference(wi, wo).wh;
        out[0] = wh.x; out[1] = wh.y; out[2] = wh.z;"""
    found = run(opencl, ["directions"], body, {"wi": wi, "wo": wo}, 3, shape=shape)
    np.testing.assert_allclose(found, half_difference(wi, wo)[:, :3], atol=3e-7)


@narrowest_and_widest
def test_turning_back_leaves_no_azimuth(opencl: Device, shape: Shape):
    w = directions(4)
    body = f"""{W} const jb_real3 t = jb_turn_back(jb_azimuth_of(w), w);
        out[0] = t.x; out[1] = t.y; out[2] = t.z; out[3] = jb_sin_theta(w);"""
    found = run(opencl, ["directions"], body, {"w": w}, 4, shape=shape)
    sine = np.hypot(*w[:, :2].T.astype(np.float64))
    np.testing.assert_allclose(found[:, 0], sine, rtol=7e-7)
    np.testing.assert_allclose(found[:, 3], sine, rtol=7e-7)
    assert (np.abs(found[:, 1]) <= 4e-7 * sine).all()
    np.testing.assert_array_equal(found[:, 2], w[:, 2])


@narrowest_and_widest
def test_directions_about_a_normal(opencl: Device, shape: Shape):
    wi, wo, n = directions(20), directions(21), directions(22)
    n = n[n[:, 2] > 0.01]
    wi, wo = wi[: len(n)], wo[: len(n)]
    body = f"""{WI_WO} const jb_real3 upward = {{3.0f * n_0, 3.0f * n_1, 3.0f * n_2}};
        const jb_NormalMapped seen = jb_normal_mapped(upward, wi, wo);
        out[0] = seen.wi.x; out[1] = seen.wi.y; out[2] = seen.wi.z; out[3] = seen.wo.z; out[4] = seen.gain;"""
    found = run(opencl, ["normal_mapped"], body, {"wi": wi, "wo": wo, "n": n}, 5, shape=shape)
    axis = np.cross([0.0, 0.0, 1.0], n)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.arctan2(sine, n[:, 2:])
    to_normal = Rotation.from_rotvec(axis / np.where(sine > 0, sine, 1.0) * angle)
    light, view = (to_normal.inv().apply(w) for w in (wi, wo))
    np.testing.assert_allclose(found[:, :4], np.column_stack([light, view[:, 2]]), atol=1e-6)
    lit = (light[:, 2] > 1e-5) & (view[:, 2] > 1e-5)
    gain = 0.5 * (light[:, 2] / wi[:, 2] + view[:, 2] / wo[:, 2])
    slack = 1e-6 * (1.0 / wi[:, 2] + 1.0 / wo[:, 2])
    assert (np.abs(found[:, 4] - gain)[lit] <= slack[lit]).all()
    assert (found[:, 4][(light[:, 2] < -1e-5) | (view[:, 2] < -1e-5)] == 0.0).all()
    assert lit.sum() > 0.5 * len(n)


def correlated_lobe(matrix: np.ndarray, wi: np.ndarray, wo: np.ndarray) -> float:
    """D G2 / (4 cos_i cos_o) of GGX along the eigenvectors of the roughness matrix (Heitz 2014, Eqs. 72, 85, 99)."""
    alpha, axes = np.linalg.eigh(matrix)
    light, view = (np.array([*(w[:2] @ axes), w[2]]) for w in (wi, wo))
    wh = (light + view) / np.linalg.norm(light + view)
    d = 1.0 / (np.pi * alpha.prod() * (((wh[:2] / alpha) ** 2).sum() + wh[2] ** 2) ** 2)
    masked = [0.5 * (np.sqrt(1.0 + ((alpha * w[:2]) ** 2).sum() / w[2] ** 2) - 1.0) for w in (light, view)]
    return d / (1.0 + sum(masked)) / (4.0 * light[2] * view[2])


@narrowest_and_widest
def test_lobe_of_a_roughness_matrix(opencl: Device, shape: Shape):
    wi, wo = directions(23), directions(24)
    raw = np.random.default_rng(25).normal(0.0, 2.0, (COUNT, 3)).astype(np.float32)
    body = f"""{WI_WO} const jb_Tensor own = jb_raw_tensor(raw_0, raw_1, raw_2);
        out[0] = jb_tensor_lobe(own, wi, wo, jb_facet(wi, wo).wh); out[1] = own.determinant;"""
    found = run(opencl, ["tensor"], body, {"wi": wi, "wo": wo, "raw": raw}, 2, shape=shape)
    least = 0.045**2
    a, b = (least + (1.0 - least) * expit(raw[:, k].astype(np.float64)) for k in (0, 1))
    c = np.tanh(raw[:, 2].astype(np.float64)) * np.sqrt(np.minimum((1 - a) * (1 - b), (a - least) * (b - least)))
    matrices = np.moveaxis(np.array([[a, c], [c, b]]), -1, 0)
    wanted = [correlated_lobe(*of) for of in zip(matrices, *(w.astype(np.float64) for w in (wi, wo)), strict=True)]
    np.testing.assert_allclose(found[:, 1], np.linalg.det(matrices), rtol=2e-5)
    np.testing.assert_allclose(found[:, 0], wanted, rtol=2e-4)


@pytest.mark.parametrize(("name", "period"), [("jb_half_turn", np.pi), ("jb_full_turn", 2 * np.pi)])
@narrowest_and_widest
def test_turn_is_the_share_of_the_period(opencl: Device, shape: Shape, name: str, period: float):
    angles = np.concatenate([np.linspace(-np.pi, np.pi, COUNT - 3), [1e-30, -1e-30, -1e-8]])
    w = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1).astype(np.float32)
    w[::2] *= np.float32(1e-6)
    found = run(opencl, ["polar"], f"{W} out[0] = {name}(w);", {"w": w}, 1, shape=shape)[:, 0]
    assert ((found >= 0) & (found <= 1)).all()
    wanted = np.arctan2(w[:, 1].astype(np.float64), w[:, 0]) / period
    away = np.abs(found - wanted + np.rint(wanted - found))
    assert away.max() < 3e-7


@pytest.mark.parametrize("name", ["jb_half_turn", "jb_full_turn"])
@narrowest_and_widest
def test_turn_at_the_pole_is_zero(opencl: Device, shape: Shape, name: str):
    w = np.array([[0, 0, 1], [-0.0, 0, 1], [0, -0.0, 1], [-0.0, -0.0, 1]])
    found = run(opencl, ["polar"], f"{W} out[0] = {name}(w);", {"w": w}, 1, shape=shape)
    np.testing.assert_array_equal(found, 0)


@narrowest_and_widest
def test_radial_warp(opencl: Device, shape: Shape):
    r = np.concatenate([[0.0, 1.0], 10.0 ** np.random.default_rng(5).uniform(-12, 0, COUNT)]).astype(np.float32)
    w = r[:, None] * np.array([0.6, -0.8, 0.0], np.float32)
    shares, exponents = np.array([0.2, 0.5, 0.3]), np.array([0.5, 1.3, 4.0])
    memory = {"terms": np.concatenate([shares, exponents]).astype(np.float32)}
    body = f"{W} out[0] = jb_radial_warp(terms, 3, jb_log2_disk_radius(w));"
    found = run(opencl, ["polar"], body, {"w": w}, 1, shape=shape, memory=memory)[:, 0]
    wanted = (shares * np.linalg.norm(w.astype(np.float64), axis=1, keepdims=True) ** exponents).sum(axis=1)
    np.testing.assert_allclose(found, wanted, rtol=5e-6, atol=1e-9)


@pytest.mark.parametrize(("channels", "dtype"), [(3, np.float32), (8, np.float32), (11, np.float32), (11, np.float16)])
@every_shape
def test_angular_fetch(opencl: Device, shape: Shape, channels: int, dtype: type):
    n_r, n_phi = 5, 7
    rng = np.random.default_rng(6)
    texture = rng.normal(size=(channels, n_r, n_phi)).astype(dtype)
    texture[:, 0] = texture[:, 0, :1]
    r = np.concatenate([[0, 1, 1, 0.25, 1.0000001, -1e-9], rng.uniform(size=COUNT)]).astype(np.float32)
    turn = np.concatenate([[0, 1, 0.99999994, 6 / 7, 0.5, 0.5], rng.uniform(size=COUNT)]).astype(np.float32)
    wrapped = np.concatenate([texture, texture[:, :, :1]], axis=2)
    memory = {"texels": np.pad(np.moveaxis(wrapped, 0, -1), ((0, 0), (0, 0), (0, -channels % 8)))}
    body = f"jb_angular_fetch(texels, {n_r}, {n_phi}, {channels}, r_0, turn_0, out);"
    inputs = {"r": r[:, None], "turn": turn[:, None]}
    found = run(opencl, ["angular"], body, inputs, channels, shape=shape, memory=memory)
    places = np.stack([np.clip(r, 0, 1) * (n_r - 1), turn.astype(np.float64) * n_phi])
    wanted = np.stack([map_coordinates(channel.astype(np.float64), places, order=1) for channel in wrapped], axis=-1)
    np.testing.assert_allclose(found, wanted, atol=5e-6)


@pytest.mark.parametrize("channels", [2, 9])
@narrowest_and_widest
def test_radial_fetch(opencl: Device, shape: Shape, channels: int):
    texture = np.random.default_rng(7).normal(size=(4, channels)).astype(np.float32)
    r = np.linspace(0, 1, COUNT).astype(np.float32)
    memory = {"texels": np.pad(texture, ((0, 0), (0, -channels % 8)))}
    body = f"jb_radial_fetch(texels, 4, {channels}, r_0, out);"
    found = run(opencl, ["angular"], body, {"r": r[:, None]}, channels, shape=shape, memory=memory)
    wanted = [np.interp(r, np.linspace(0, 1, 4), column) for column in texture.T.astype(np.float64)]
    np.testing.assert_allclose(found, np.stack(wanted, axis=-1), atol=2e-6)


@narrowest_and_widest
def test_a_lookup_at_no_number_stays_inside_its_texture(opencl: Device, shape: Shape):
    bad = np.array([np.nan, np.inf, -np.inf, 3e38, -3e38, -1.0, 7.0], np.float32)
    r, turn = (a.reshape(-1, 1) for a in np.meshgrid(bad, bad))
    memory = {"texels": np.ones((3, 5, 8), np.float32)}
    body = "jb_angular_fetch(texels, 3, 4, 1, r_0, turn_0, out);"
    found = run(opencl, ["angular"], body, {"r": r, "turn": turn}, 1, shape=shape, memory=memory)
    np.testing.assert_array_equal(found, 1.0)


@pytest.mark.parametrize("widths", [(4, 3), (2, 5, 3), (6, 3, 9, 4, 3), (7, 13, 27, 12, 1)])
@pytest.mark.parametrize("activation", ["silu", "relu"])
@narrowest_and_widest
def test_network(opencl: Device, shape: Shape, widths: tuple[int, ...], activation: str):
    mlp = network.random(8, widths)
    macros, values = network_parameters(mlp, shape, activation=activation)
    x = np.random.default_rng(9).normal(size=(COUNT, widths[0]))
    layers = macros["JB_MLP_LAYERS(LAYER)"].replace("LAYER(", "JB_LAYER(")
    feed = " ".join(f"x[{k}] = x_{k};" for k in range(widths[0]))
    # the inputs' names x_k stay visible beside the pointers
    body = f"""jb_real even[{max(widths)}], odd[{max(widths)}]; jb_real *x = even, *y = odd; {feed}
        {layers} for (int k = 0; k < {widths[-1]}; ++k) out[k] = x[k];"""
    found = run(opencl, ["network"], body, {"x": x}, widths[-1], shape=shape, memory={"weights": values})
    value = x
    for weight, bias in zip(mlp.weights[:-1], mlp.biases[:-1], strict=True):
        value = value @ np.asarray(weight, np.float64) + bias
        value = value * expit(value) if activation == "silu" else np.maximum(value, 0)
    value = value @ np.asarray(mlp.weights[-1], np.float64) + mlp.biases[-1]
    np.testing.assert_allclose(found, value, atol=2e-5)


@narrowest_and_widest
def test_reflectance_is_bounded_and_does_not_hide_a_nan(opencl: Device, shape: Shape):
    log2_f = np.array([-126, -20, 0, 5, 115, 116, 1e30, np.nan, np.inf], np.float32)[:, None]
    found = run(opencl, ["output"], "out[0] = jb_reflectance(l_0);", {"l": log2_f}, 1, shape=shape)
    wanted = np.exp(np.minimum(np.log(2) * log2_f.astype(np.float64), 80))
    np.testing.assert_allclose(found, wanted, rtol=2e-6, atol=1e-37)


@pytest.mark.parametrize("count", [1, 2, 15, 16, 17, 33])
@pytest.mark.parametrize("is_interleaved", [0, 1])
@every_shape
def test_queries_come_back_whole(opencl: Device, shape: Shape, count: int, is_interleaved: int):
    w = np.arange(3 * count, dtype=np.float32)
    guarded = np.concatenate([w, [-1.0]]).astype(np.float32)
    source = settings(shape, "float32") + helpers("queries")
    source += """__kernel void copy(const uint count, const uint layout, __global const float *w, __global float *f) {
        const size_t first = get_global_id(0) * JB_WIDTH;
        jb_store_colours(f, first, count, layout, jb_load_directions(w, first, count, layout));
    }"""
    kernel = cl.Kernel(build(opencl.context, source), "copy")
    results = np.full_like(guarded, -1.0)
    flags = cl.mem_flags.COPY_HOST_PTR
    given, taken = (cl.Buffer(opencl.context, flags, hostbuf=array) for array in (guarded, results))
    kernel.set_args(np.uint32(count), np.uint32(is_interleaved), given, taken)
    cl.enqueue_nd_range_kernel(opencl.queue, kernel, (-(-count // shape.width),), None)
    cl.enqueue_copy(opencl.queue, results, taken)
    np.testing.assert_array_equal(results, guarded)
