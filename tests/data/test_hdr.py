"""Radiance pictures against Mitsuba, and each encoding by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jaxbrdf.data.hdr import read
from jaxbrdf.errors import DataError

HEAD = b"#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\n\n"
PIXELS = np.random.default_rng(0).integers(2, 256, (3, 10, 4), np.uint8)


def decoded(rgbe: np.ndarray) -> np.ndarray:
    return np.ldexp(rgbe[..., :3].astype(np.float64), rgbe[..., 3:].astype(int) - 136)


def flat(pixels: np.ndarray, resolution: bytes = b"-Y 3 +X 10\n", head: bytes = HEAD) -> bytes:
    return head + resolution + pixels.tobytes()


@pytest.mark.parametrize(
    "name", ["polyhaven_city", "polyhaven_studio", "polyhaven_sunset", "materialx_irradiance_goegap"]
)
def test_real_picture_agrees_with_mitsuba(name: str, data_dir: Path, mitsuba_rgb) -> None:
    path = data_dir / "env" / f"{name}.hdr"
    bitmap = mitsuba_rgb.Bitmap(str(path))
    theirs = np.array(bitmap.convert(mitsuba_rgb.Bitmap.PixelFormat.RGB, mitsuba_rgb.Struct.Type.Float32, False))
    np.testing.assert_array_equal(read(path.read_bytes(), path), theirs)


def test_plain_pixels() -> None:
    np.testing.assert_allclose(read(flat(PIXELS), "made"), decoded(PIXELS), rtol=1e-6)


def test_exponent_zero_is_black() -> None:
    pixels = PIXELS.copy()
    pixels[1, 2, 3] = 0
    np.testing.assert_array_equal(read(flat(pixels), "made")[1, 2], 0.0)


def test_runs_of_one_component_after_another() -> None:
    lines = b""
    for row in PIXELS:
        lines += b"\2\2\0\12"
        for component in row.T:
            lines += bytes([4]) + component[:4].tobytes() + bytes([128 + 5, component[4], 1, component[9]])
    expected = PIXELS.copy()
    expected[:, 4:9] = PIXELS[:, 4:5]
    np.testing.assert_allclose(read(HEAD + b"-Y 3 +X 10\n" + lines, "made"), decoded(expected), rtol=1e-6)


def test_old_runs_repeat_the_pixel_before_and_count_on_in_256s() -> None:
    first, second = bytes([9, 8, 7, 130]), bytes([3, 4, 5, 129])
    line = first + bytes([1, 1, 1, 4]) + bytes([1, 1, 1, 1]) + second
    picture = read(HEAD + b"-Y 1 +X 262\n" + line, "made")
    expected = np.array([list(first)] * 261 + [list(second)], np.uint8)[None]
    np.testing.assert_allclose(picture, decoded(expected), rtol=1e-6)


def test_exposures_are_divided_out() -> None:
    head = HEAD[:-1] + b"EXPOSURE=2.0\nEXPOSURE= 4\n\n"
    np.testing.assert_allclose(read(flat(PIXELS, head=head), "made"), decoded(PIXELS) / 8.0, rtol=1e-6)


@pytest.mark.parametrize(
    ("resolution", "upright"),
    [
        (b"+Y 3 +X 10\n", lambda p: p[::-1]),
        (b"-Y 3 -X 10\n", lambda p: p[:, ::-1]),
        (b"+X 3 -Y 10\n", lambda p: p.swapaxes(0, 1)),
        (b"-X 3 -Y 10\n", lambda p: p.swapaxes(0, 1)[:, ::-1]),
        (b"+X 3 +Y 10\n", lambda p: p.swapaxes(0, 1)[::-1]),
    ],
)
def test_other_orders_of_pixels(resolution: bytes, upright) -> None:
    np.testing.assert_allclose(read(flat(PIXELS, resolution), "made"), upright(decoded(PIXELS)), rtol=1e-6)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"P6\n", "not a Radiance picture"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe", "cut off"),
        (b"#?RADIANCE\n\n", "resolution"),
        (b"#?RADIANCE\n\n-Y 3 +Y 10\n" + bytes(120), "resolution"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", "32-bit_rle_xyze"),
        (b"#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n", "exposure '0'"),
        (b"#?RADIANCE\nEXPOSURE=much\n\n-Y 1 +X 1\n", "exposure 'much'"),
        (flat(PIXELS, b"-Y 65536 +X 32768\n"), "claims 65536 x 32768 pixels"),
        (flat(PIXELS, b"-Y 0 +X 10\n"), "claims 0 x 10"),
        (flat(PIXELS)[:-1], "cut off"),
        (HEAD + b"-Y 1 +X 10\n\2\2\0\13" + bytes(40), "claims 11 pixels"),
        (HEAD + b"-Y 1 +X 10\n\2\2\0\12" + b"\x8f\1" * 20, "does not fit"),
        (HEAD + b"-Y 1 +X 10\n\2\2\0\12" + b"\0\0" * 20, "does not fit"),
        (HEAD + b"-Y 1 +X 4\n\1\1\1\2" + bytes(16), "does not fit"),
    ],
)
def test_first_wrong_thing_is_named(content: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said):
        read(content, "made.hdr")
