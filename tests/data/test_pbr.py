"""Texture sets: the real ones against Pillow and colour-science, made ones for each rule and each refusal."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import colour
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from jaxbrdf.data import exr
from jaxbrdf.data.pbr import PbrTextures, read_folder
from jaxbrdf.data.resampled import resampled
from jaxbrdf.errors import DataError
from tests.data.test_normal_map import NAMED, RATIOS, noise, waves
from tests.writers.png import png

RNG = np.random.default_rng(0)
COLOUR = RNG.integers(0, 256, (6, 9, 3), np.uint8)
GREY = RNG.integers(0, 65536, (6, 9, 1), np.uint16)
FLAT = np.tile(np.uint8([128, 128, 255]), (6, 9, 1))


def bump() -> np.ndarray:
    """8-bit OpenGL normals, `(96, 96, 3)`."""
    return levels(waves(96))


def levels(encoded: np.ndarray) -> np.ndarray:
    return np.rint(encoded * 255.0).astype(np.uint8)


def directx(opengl: np.ndarray) -> np.ndarray:
    return np.stack([opengl[..., 0], 255 - opengl[..., 1], opengl[..., 2]], axis=-1)


def folder(path: Path, files: Mapping[str, np.ndarray | bytes]) -> Path:
    for name, content in files.items():
        (path / name).write_bytes(content if isinstance(content, bytes) else png(content))
    return path


def said(textures: PbrTextures, *words: str) -> bool:
    """Whether one of the lines has all the words."""
    return any(all(word in line for word in words) for line in textures.told)


def stored(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path)).astype(np.float64) / 255.0


@pytest.mark.parametrize("name", RATIOS)
def test_real_set(name: str, data_dir: Path) -> None:
    path = data_dir / "textures" / Path(name).parent
    textures = read_folder(path)
    rows, columns = (512, 1024) if path.name == "Bricks102" else (1024, 1024)
    assert [part.shape for part in textures[:4]] == [
        (rows, columns, 3), (rows, columns), (rows, columns), (rows, columns, 3)
    ]  # fmt: skip
    assert all(part.dtype == np.float32 and part.flags.writeable for part in textures[:4])
    assert all(part.min() >= 0.0 and part.max() <= 1.0 for part in textures[:3])
    np.testing.assert_allclose(np.linalg.norm(textures.normal, axis=-1), 1.0, atol=1e-6)
    assert textures.normal[..., 2].min() > 0.0
    assert said(textures, "normal: ", "OpenGL", "by its name" if name in NAMED else "by its slopes")


def test_ambientcg_s_maps(data_dir: Path) -> None:
    path = data_dir / "textures" / "Metal049A"
    textures = read_folder(path)
    linear = colour.models.eotf_sRGB(stored(path / "Metal049A_1K-JPG_Color.jpg"))
    # the standard's two slopes meet at 0.04045 within 1e-7
    np.testing.assert_allclose(textures.base_color, linear, atol=1e-6)
    np.testing.assert_allclose(textures.roughness, stored(path / "Metal049A_1K-JPG_Roughness.jpg"), atol=1e-7)
    np.testing.assert_allclose(textures.metallic, stored(path / "Metal049A_1K-JPG_Metalness.jpg"), atol=1e-7)
    assert textures.metallic.mean() > 0.99


def test_poly_haven_s_packed_maps(data_dir: Path) -> None:
    path = data_dir / "textures" / "fabric_pattern_07"
    textures, packed = read_folder(path), stored(path / "fabric_pattern_07_arm_1k.jpg")
    np.testing.assert_allclose(textures.roughness, packed[..., 1], atol=1e-7)
    np.testing.assert_allclose(textures.metallic, packed[..., 2], atol=1e-7)
    assert said(textures, "roughness: ", "arm", "green")
    assert said(textures, "metallic: ", "arm", "blue")


def test_base_colour_alone(tmp_path: Path) -> None:
    textures = read_folder(folder(tmp_path, {"albedo.png": COLOUR}))
    assert (textures.roughness == 0.5).all()
    assert (textures.metallic == 0.0).all()
    np.testing.assert_array_equal(textures.normal, np.broadcast_to([0.0, 0.0, 1.0], (6, 9, 3)))
    for what, default in (("roughness", "0.5"), ("metallic", "0.0"), ("normal", "flat")):
        assert said(textures, what, default, "by default")


def test_one_texel(tmp_path: Path) -> None:
    texel = {"albedo.png": COLOUR, "normal.png": FLAT, "roughness.png": GREY, "metallic.png": GREY}
    textures = read_folder(folder(tmp_path, {name: pixels[:1, :1] for name, pixels in texel.items()}))
    assert [part.shape for part in textures[:4]] == [(1, 1, 3), (1, 1), (1, 1), (1, 1, 3)]
    np.testing.assert_allclose(textures.normal[0, 0], [0.0, 0.0, 1.0], atol=0.006)


def test_16_bits_reach_the_values(tmp_path: Path) -> None:
    deep = RNG.integers(0, 65536, (6, 9, 3), np.uint16)
    textures = read_folder(folder(tmp_path, {"x_Color.png": deep, "x_Roughness.png": GREY}))
    np.testing.assert_allclose(textures.base_color, colour.models.eotf_sRGB(deep / 65535.0), atol=1e-6)
    np.testing.assert_allclose(textures.roughness, GREY[..., 0] / 65535.0, atol=1e-7)


def test_linear_base_colours(tmp_path: Path) -> None:
    (tmp_path / "named").mkdir()
    (tmp_path / "floats").mkdir()
    named = read_folder(folder(tmp_path / "named", {"albedo_linear.png": COLOUR}))
    np.testing.assert_allclose(named.base_color, COLOUR / 255.0, atol=1e-7)
    assert said(named, "base colour", "linear by its name")
    floats = (COLOUR / 200.0).astype(np.float32)
    textures = read_folder(folder(tmp_path / "floats", {"albedo.exr": exr.write(floats)}))
    np.testing.assert_array_equal(textures.base_color, np.minimum(floats, 1.0))
    assert said(textures, "floats, which are linear", "were clamped")


def test_colours_of_grey_files(tmp_path: Path) -> None:
    grey = np.repeat(COLOUR[..., :1], 3, axis=-1)
    textures = read_folder(folder(tmp_path, {"diffuse.png": COLOUR[..., :1], "roughness.png": grey}))
    np.testing.assert_allclose(textures.roughness, grey[..., 0] / 255.0, atol=1e-7)
    np.testing.assert_array_equal(textures.base_color[..., 0], textures.base_color[..., 2])


def test_up_is_up_in_both_conventions(tmp_path: Path) -> None:
    # the texels of the top half lean up, those of the bottom half down, as on a pillow's edges
    lean = np.repeat(np.uint8([[[128, 200, 230]], [[128, 56, 230]]]), 8, axis=1)
    colours = COLOUR[:2, :8]
    for convention, sign in (("opengl", 1.0), ("directx", -1.0)):
        textures = read_folder(folder(tmp_path, {"albedo.png": colours, "normal.png": lean}), normals=convention)
        np.testing.assert_array_equal(np.sign(textures.normal[:, 0, 1]), [sign, -sign])
        assert said(textures, "normal", "as asked")


@pytest.mark.parametrize("turn", [lambda pixels: pixels, directx])
def test_plain_normals_are_told_by_their_slopes(turn, tmp_path: Path) -> None:
    colours = RNG.integers(0, 256, (96, 96, 3), np.uint8)
    textures = read_folder(folder(tmp_path, {"albedo.png": colours, "normal.png": turn(bump())}))
    expected = bump() / 127.5 - 1.0
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    np.testing.assert_allclose(textures.normal, expected, atol=1e-5)
    assert said(textures, "OpenGL" if turn is not directx else "DirectX by its slopes", "curl")


def test_a_name_stands_against_slopes_but_it_is_told(tmp_path: Path) -> None:
    colours = RNG.integers(0, 256, (96, 96, 3), np.uint8)
    textures = read_folder(folder(tmp_path, {"albedo.png": colours, "x_NormalDX.png": bump()}))
    assert said(textures, "DirectX by its name, though its slopes look like OpenGL")
    assert textures.normal[0, 0, 1] == pytest.approx(-(bump()[0, 0, 1] / 127.5 - 1.0), abs=0.01)


def test_of_two_conventions_one_is_taken(tmp_path: Path) -> None:
    files = {"albedo.png": COLOUR, "x_NormalGL.png": FLAT, "x_NormalDX.png": FLAT}
    textures = read_folder(folder(tmp_path, files))
    assert said(textures, "normal: x_NormalGL.png, OpenGL by its name")
    assert said(textures, "x_NormalDX.png: not used")
    assert said(read_folder(tmp_path, normals="directx"), "normal: x_NormalDX.png, DirectX")


def test_what_is_left_aside_is_told(tmp_path: Path) -> None:
    files = {
        "x_diff_1k.png": COLOUR,
        "x_rough_1k.png": GREY,
        "x_arm_1k.png": COLOUR,
        "x_ao_1k.png": GREY,
        "x.png": GREY,
    }
    ignored = {"x.mtlx": b"<", "readme.txt": b"", "._x_diff_1k.png": b"", ".DS_Store": b""}
    textures = read_folder(folder(tmp_path, files | ignored))
    np.testing.assert_allclose(textures.roughness, GREY[..., 0] / 65535.0, atol=1e-7)
    np.testing.assert_allclose(textures.metallic, COLOUR[..., 2] / 255.0, atol=1e-7)
    assert said(textures, "x_ao_1k.png: not used, a metallic-roughness material has no such map")
    assert said(textures, "x.png: not used, its name tells no map")
    assert not said(textures, "readme")


def test_a_packed_file_that_gives_nothing_is_told(tmp_path: Path) -> None:
    files = {"albedo.png": COLOUR, "roughness.png": GREY, "metallic.png": GREY, "x_ORM.png": COLOUR}
    assert said(read_folder(folder(tmp_path, files)), "x_ORM.png: not used, another file has its values")


def large(pixels: np.ndarray, factor: int) -> np.ndarray:
    return np.repeat(np.repeat(pixels, factor, axis=0), factor, axis=1)


def test_other_sizes(tmp_path: Path) -> None:
    files = {"albedo.png": COLOUR, "roughness.png": large(GREY, 3), "metallic.png": GREY[:1, :1], "normal.png": FLAT}
    with pytest.raises(DataError, match=r"roughness\.png: is 18 x 27, but albedo\.png is 6 x 9"):
        read_folder(folder(tmp_path, files))
    textures = read_folder(tmp_path, resample=True)
    np.testing.assert_allclose(textures.roughness, GREY[..., 0] / 65535.0, atol=1e-6)
    np.testing.assert_allclose(textures.metallic, GREY[0, 0, 0] / 65535.0, atol=1e-6)
    assert said(textures, "roughness.png: resampled from 18 x 27 to 6 x 9")


def test_resampled_normals_are_unit_vectors(tmp_path: Path) -> None:
    for name, colours in (("smaller", COLOUR), ("larger", large(COLOUR, 20))):
        (tmp_path / name).mkdir()
        path = folder(tmp_path / name, {"albedo.png": colours, "x_NormalGL.png": bump()})
        normal = read_folder(path, resample=True).normal
        assert normal.shape == colours.shape
        np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1.0, atol=1e-6)


@given(
    values=arrays(
        np.float32, st.tuples(st.integers(1, 6), st.integers(1, 6), st.just(2)), elements=st.floats(0, 1, width=32)
    ),
    factor=st.integers(1, 4),
)
def test_reduction_is_the_mean_of_the_area(values: np.ndarray, factor: int) -> None:
    rng = np.random.default_rng(0)
    fine = large(values, factor) + rng.random((values.shape[0] * factor, values.shape[1] * factor, 1), np.float32)
    blocks = fine.reshape(values.shape[0], factor, values.shape[1], factor, 2).mean(axis=(1, 3))
    np.testing.assert_allclose(resampled(fine, values.shape[:2]), blocks, atol=1e-5)


def test_enlargement_is_linear_between_centres() -> None:
    ramp = np.float32([[[0.0], [1.0]]])
    np.testing.assert_allclose(resampled(ramp, (1, 8))[0, :, 0], [0, 0, 0.125, 0.375, 0.625, 0.875, 1, 1], atol=1e-6)
    assert resampled(np.ones((4, 2, 1), np.float32), (2, 4)).shape == (2, 4, 1)


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({}, ["holds no pictures"]),
        ({"readme.txt": b"x"}, ["holds no pictures"]),
        ({"x_rough_1k.png": GREY}, ["no base colour", "x_rough_1k.png"]),
        ({"albedo.png": COLOUR, "x_diff_1k.png": COLOUR}, ["two files", "base colour", "albedo.png", "x_diff_1k.png"]),
        ({"albedo.png": COLOUR, "x_ORM.png": COLOUR, "x_ARM.png": COLOUR}, ["two files", "x_ARM.png", "x_ORM.png"]),
        ({"albedo.png": COLOUR, "a_nor_gl.png": FLAT, "a_NormalGL.png": FLAT}, ["two files", "a_nor_gl.png"]),
        ({"albedo.png": COLOUR, "normal.png": FLAT, "a_NormalGL.png": FLAT}, ["two files", "normal.png"]),
        ({"albedo.png": b"\x89PNG\r\n\x1a\nx"}, ["albedo.png", "not a readable PNG"]),
        ({"albedo.png": b""}, ["albedo.png", "empty"]),
        ({"albedo.png": COLOUR, "roughness.tif": b"II*\0"}, ["roughness.tif", "not a PNG, JPEG, OpenEXR or Radiance"]),
        ({"albedo.png": COLOUR, "roughness.png": COLOUR}, ["roughness.png", "channels differ", "not roughness alone"]),
        ({"albedo.png": COLOUR, "x_ORM.png": GREY}, ["x_ORM.png", "is grey"]),
        ({"albedo.png": COLOUR, "normal.png": COLOUR}, ["normal.png", "does not look like a normal map"]),
        ({"albedo.png": COLOUR, "normal.png": levels(noise(96))}, ["normal.png", "give normals="]),
    ],
)  # fmt: skip
def test_first_wrong_thing_is_named(files: dict, words: list[str], tmp_path: Path) -> None:
    with pytest.raises(DataError) as caught:
        read_folder(folder(tmp_path, files))
    assert all(word in str(caught.value) for word in words), caught.value
    assert "\n" not in str(caught.value)


def test_what_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file.png").write_bytes(png(COLOUR))
    for name, words in (("file.png", "is a file, not a folder"), ("missing", "no such file"), ("a\0b", "null")):
        with pytest.raises(DataError, match=words):
            read_folder(tmp_path / name)
    (tmp_path / "archive" / "textures").mkdir(parents=True)
    with pytest.raises(DataError, match="holds no pictures, but a folder textures"):
        read_folder(tmp_path / "archive")
    (tmp_path / "albedo.png").mkdir()
    with pytest.raises(DataError, match=r"albedo\.png: is a folder"):
        read_folder(tmp_path)


def test_a_convention_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="normals is 'gl'; should be one of"):
        read_folder(tmp_path, normals="gl")  # type: ignore[arg-type]


def test_jpeg_s_grey_saved_as_colour_passes(tmp_path: Path) -> None:
    smooth = np.linspace(40.0, 200.0, 64).astype(np.uint8)[None, :, None] * np.ones((64, 1, 3), np.uint8)
    stream = io.BytesIO()
    Image.fromarray(smooth).save(stream, "JPEG", quality=60)
    files = {"albedo.png": np.zeros((64, 64, 3), np.uint8), "roughness.jpg": stream.getvalue()}
    assert np.abs(read_folder(folder(tmp_path, files)).roughness - smooth[..., 0] / 255.0).max() < 0.03
