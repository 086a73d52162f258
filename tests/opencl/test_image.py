"""Spatial lookups in OpenCL against the same one texel at a time in float64; the largest at every width."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from jaxbrdf.opencl.shape import Shape
from jaxbrdf.texture.pyramid import Layout, Wrap
from tests.opencl.conftest import Device
from tests.opencl.kernels import SHAPES, run
from tests.texture import slow

COUNT = 96


def table(layout: Layout, channels: int, dtype: type) -> np.ndarray:
    """Levels of which none is made from another, so that a wrong one is seen."""
    return np.random.default_rng(1).uniform(-1, 1, (layout.texels, channels)).astype(dtype)


def places() -> np.ndarray:
    """Texture coordinates within and far outside one period, `(n, 2)` float32."""
    rng = np.random.default_rng(2)
    hard = [(0, 0), (1, 1), (-1e-9, 0.5), (0.5, 1 - 6e-8), (3e7, -1e12), (-4194305.5, 8388607.5)]
    return np.concatenate([hard, rng.uniform(0, 1, (COUNT, 2)), rng.uniform(-40, 40, (COUNT, 2))]).astype(np.float32)


def hard_and_random() -> tuple[np.ndarray, np.ndarray]:
    """Places and footprints: of size zero, lines, beyond every pyramid, infinite, NaN; and random ones."""
    inf, nan = np.inf, np.nan
    finite = [(0, 0, 0, 0), (1e-30,) * 4, (0.25, 0, 0.25, 0), (1e30, 0, 0, 1e-3)]
    hard = np.array([*finite, (0, inf, 0, 0), (nan, 0, 0, 1), (0, 0, 0, nan)]).reshape(-1, 2, 2)
    uv = places()[6:]
    uv[-2:] = [(nan, 0.5), (0.5, nan)]
    footprint = slow.footprints(len(uv), 100)
    footprint[: len(hard)] = hard
    return uv, footprint


def struct(layout: Layout, channels: int) -> str:
    wrap = f"JB_{layout.wrap.upper()}"
    return f"const jb_Layout layout = {{{layout.height}, {layout.width}, {wrap}, {layout.top}, {channels}}};\n"


def call(opencl: Device, texels: np.ndarray, body: str, inputs: dict, outputs: int, shape: Shape) -> np.ndarray:
    padded = np.pad(texels, ((0, 0), (0, -texels.shape[1] % 8)))
    return run(opencl, ["image"], body, inputs, outputs, shape=shape, memory={"texels": padded})


@pytest.mark.parametrize("shape", SHAPES[3:], ids=str)
def test_bilinear_of_every_wrap(opencl: Device, shape: Shape):
    uv = places()
    layouts = [Layout(6, 11, wrap) for wrap in get_args(Wrap)]
    texels = table(layouts[0], 3, np.float32)
    one = "{{{} jb_bilinear(texels, layout, uv_0, uv_1, 1, out + {}); }}"
    calls = [one.format(struct(layout, 3), 3 * k) for k, layout in enumerate(layouts)]
    found = call(opencl, texels, "\n".join(calls), {"uv": uv}, 9, shape)
    image = slow.levels(layouts[0], texels)[1]
    wanted = [[slow.bilinear(layout, image, *at) for layout in layouts] for at in uv.astype(np.float64)]
    np.testing.assert_allclose(found.reshape(-1, 3, 3), wanted, atol=2e-5)


@pytest.mark.parametrize("shape", SHAPES[1:2], ids=str)
def test_trilinear_of_half_texels(opencl: Device, shape: Shape):
    layout, uv = Layout(13, 6, "mirror"), places()
    lod = np.resize([-1, 0, 1e-7, 0.3, 1, 1.999, 2.5, 3, 7, 1e30], (len(uv), 1)).astype(np.float32)
    texels = table(layout, 11, np.float16)
    body = struct(layout, 11) + "jb_trilinear(texels, layout, uv_0, uv_1, jb_between_levels(layout, lod_0), out);"
    found = call(opencl, texels, body, {"uv": uv, "lod": lod}, 11, shape)
    images = slow.levels(layout, texels)
    at = np.concatenate([uv, lod], axis=1).astype(np.float64)
    np.testing.assert_allclose(found, [slow.trilinear(layout, images, *x) for x in at], atol=2e-5)


def anisotropic_as_the_slow_one(opencl: Device, shape: Shape, layout: Layout, most: tuple[int, ...]) -> None:
    uv, footprint = hard_and_random()
    texels = table(layout, 8, np.float32)
    body = f"{struct(layout, 8)} const jb_Footprint footprint = {{j_0, j_1, j_2, j_3}};"
    for k, probes in enumerate(most):
        body += f"jb_anisotropic(texels, layout, uv_0, uv_1, footprint, {probes}, out + {8 * k});"
    found = call(opencl, texels, body, {"uv": uv, "j": footprint.reshape(-1, 4)}, 8 * len(most), shape)
    images, asked = slow.levels(layout, texels), list(zip(uv.astype(np.float64), footprint, strict=True))
    wanted = [[slow.anisotropic(layout, images, at, j, probes) for probes in most] for at, j in asked]
    np.testing.assert_allclose(found.reshape(-1, len(most), 8), wanted, atol=2e-5)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_anisotropic(opencl: Device, shape: Shape):
    anisotropic_as_the_slow_one(opencl, shape, Layout(16, 32), (16,))


@pytest.mark.parametrize("shape", SHAPES[2:3], ids=str)
def test_anisotropic_with_fewer_probes(opencl: Device, shape: Shape):
    anisotropic_as_the_slow_one(opencl, shape, Layout(20, 7, "clamp"), (1, 5))
