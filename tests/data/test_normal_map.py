"""Normals of heights whose slopes are known, and the nine real maps with green as it is and turned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from jaxbrdf.data.normal_map import convention, decode, flipped, residual
from jaxbrdf.errors import DataError

NAMED = {
    "Bricks102/Bricks102_1K-JPG_NormalGL.jpg": 0.056,
    "Metal049A/Metal049A_1K-JPG_NormalGL.jpg": 0.632,
    "cobblestone_floor_08/cobblestone_floor_08_nor_gl_1k.jpg": 0.072,
    "fabric_pattern_07/fabric_pattern_07_nor_gl_1k.jpg": 0.316,
}
PLAIN = {"Facade005": 0.039, "Metal053C": 0.126, "Metal055A": 0.212, "Onyx003": 0.485, "Rock058": 0.035}
RATIOS = NAMED | {f"{name}/normal.jpg": ratio for name, ratio in PLAIN.items()}


def picture(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"), np.float32) / np.float32(255.0)


def waves(side: int, seed: int = 0) -> np.ndarray:
    """Encoded OpenGL normals of a sum of waves over the unit square, v up, `(side, side, 3)`, by their derivatives."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid((np.arange(side) + 0.5) / side, 1.0 - (np.arange(side) + 0.5) / side)
    slope = np.zeros((2, side, side))
    for kx, ky, phase in zip(*rng.integers(-6, 7, (2, 12)), rng.uniform(0.0, 2.0 * np.pi, 12), strict=True):
        slope += 0.1 * np.cos(2.0 * np.pi * (kx * u + ky * v) + phase) * np.array([kx, ky])[:, None, None]
    normals = np.stack([-slope[0], -slope[1], np.ones_like(u)], axis=-1)
    return encode(normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def noise(side: int) -> np.ndarray:
    """Encoded normals of no surface."""
    return encode(np.random.default_rng(0).normal(size=(side, side, 3)) * [0.2, 0.2, 0.0] + [0.0, 0.0, 0.9])


def encode(normals: np.ndarray) -> np.ndarray:
    return (np.rint((normals + 1.0) * 127.5) / 255.0).astype(np.float32)


@pytest.mark.parametrize(("name", "ratio"), RATIOS.items())
def test_real_maps(name: str, ratio: float, data_dir: Path) -> None:
    opengl = decode(picture(data_dir / "textures" / name), name).normals
    found = residual(opengl)
    assert found == pytest.approx(ratio, abs=0.001)
    assert residual(flipped(opengl)) == pytest.approx(1.0 / found, rel=1e-4)
    assert convention(opengl, found) == "opengl"
    assert convention(flipped(opengl), 1.0 / found) == "directx"


@pytest.mark.parametrize("name", NAMED)
def test_corners_of_real_maps_never_mislead(name: str, data_dir: Path) -> None:
    opengl = decode(picture(data_dir / "textures" / name), name).normals
    parts = [opengl[i : i + 64, j : j + 64] for i in range(0, 512, 128) for j in range(0, 512, 128)]
    assert "directx" not in [convention(part, residual(part)) for part in parts]


@pytest.mark.parametrize("seed", range(4))
def test_waves_have_the_curl_of_their_convention(seed: int) -> None:
    opengl = decode(waves(96, seed), "made").normals
    assert residual(opengl) < 0.01
    assert convention(opengl, residual(opengl)) == "opengl"
    assert convention(flipped(opengl), residual(flipped(opengl))) == "directx"


def test_noise_and_little_texture_decide_nothing() -> None:
    texel = np.asarray([[[0.5, 0.6, 0.99]]], np.float32)
    for encoded in (noise(64), np.tile(waves(64)[:1], (64, 1, 1)), waves(96)[:2], texel):
        opengl = decode(encoded, "made").normals
        assert convention(opengl, residual(opengl)) is None


@pytest.mark.parametrize("shape", [(1, 1), (2, 5), (40, 40)])
def test_flat_is_the_same_in_both(shape: tuple[int, int]) -> None:
    opengl = decode(np.broadcast_to(np.float32([128, 128, 255]) / 255.0, (*shape, 3)), "made").normals
    assert convention(opengl, residual(opengl)) == "opengl"


@given(angle=st.floats(0.0, 1.2), azimuth=st.floats(-np.pi, np.pi), length=st.floats(0.55, 1.0), side=st.integers(1, 5))
def test_directions_survive_any_length(angle: float, azimuth: float, length: float, side: int) -> None:
    tangential = np.sin(angle) * np.array([np.cos(azimuth), np.sin(azimuth)])
    pair = np.array([[*tangential, np.cos(angle)], [*-tangential, np.cos(angle)]])
    encoded = np.tile((length * pair[None] + 1.0) / 2.0, (side, 1, 1)).astype(np.float32)
    normals, off = decode(encoded, "made")
    assert off == 0
    np.testing.assert_allclose(normals, np.tile(pair[None], (side, 1, 1)), atol=1e-6)


def test_few_texels_that_are_no_normals_are_counted() -> None:
    encoded = waves(64)
    encoded[3, 5], encoded[7, 9], encoded[0, 0] = 0.0, 0.5, [0.7, 0.5, 0.6]
    normals, off = decode(encoded, "made")
    assert off == 3
    np.testing.assert_array_equal(normals[3, 5], [0.0, 0.0, 1.0])
    np.testing.assert_allclose(normals[0, 0], np.array([0.4, 0.0, 0.2]) / np.sqrt(0.2), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0, atol=1e-6)


@pytest.mark.parametrize(
    ("encoded", "said"),
    [
        (np.full((4, 4, 1), 0.9), "it is grey"),
        (np.full((4, 4, 3), 0.1), "100% of its texels"),
        (np.full((4, 4, 3), 1e30), "100% of its texels"),
        (np.full((4, 4, 3), 0.75), "lean by 0.82"),
    ],
)
def test_other_pictures_are_refused(encoded: np.ndarray, said: str) -> None:
    with pytest.raises(DataError, match=f"normal map: .*{said}"):
        decode(encoded.astype(np.float32), "made")


def test_no_other_real_map_passes_for_normals(data_dir: Path) -> None:
    others = [path for path in (data_dir / "textures").glob("*/*.jpg") if "nor" not in path.stem.lower()]
    assert len(others) > 15
    for path in others:
        with pytest.raises(DataError, match="does not look like a normal map"):
            decode(picture(path)[::4, ::4], path)
