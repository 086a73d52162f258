"""Pictures written by hand, by Pillow and by this package's own writers; Mitsuba reads the same files."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from jaxbrdf.data import exr
from jaxbrdf.data.picture import read
from jaxbrdf.errors import DataError
from tests.writers.png import png

RNG = np.random.default_rng(0)
DEEP = RNG.integers(0, 65536, (9, 13, 4), np.uint16)
BYTES = RNG.integers(0, 256, (9, 13, 4), np.uint8)


def jpeg(pixels: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "JPEG", quality=95)
    return stream.getvalue()


def colours(pixels: np.ndarray) -> np.ndarray:
    """Without the alpha that two and four channels end with."""
    return pixels[..., : {1: 1, 2: 1, 3: 3, 4: 3}[pixels.shape[2]]]


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("pixels", [BYTES, DEEP], ids=["8 bits", "16 bits"])
def test_no_bit_of_a_png_is_lost(pixels: np.ndarray, channels: int, interlaced: bool) -> None:
    values, integer = read(png(pixels[..., :channels], interlaced=interlaced), "made")
    most = np.iinfo(pixels.dtype).max
    assert integer
    assert values.dtype == np.float32
    np.testing.assert_array_equal(np.rint(values.astype(np.float64) * most), colours(pixels[..., :channels]))


@given(pixels=arrays(np.uint16, st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(3))))
def test_16_bit_colours_of_any_size(pixels: np.ndarray) -> None:
    np.testing.assert_array_equal(read(png(pixels), "made").values, (pixels / 65535.0).astype(np.float32))


def test_mitsuba_reads_the_same_16_bits(tmp_path: Path, mitsuba_rgb) -> None:
    (tmp_path / "x.png").write_bytes(png(DEEP[..., :3]))
    theirs = np.array(mitsuba_rgb.Bitmap(str(tmp_path / "x.png")))
    assert theirs.dtype == np.uint16
    np.testing.assert_array_equal(read(png(DEEP[..., :3]), "made").values, (theirs / 65535.0).astype(np.float32))


def test_palette_s_colours() -> None:
    palette = RNG.integers(0, 256, (256, 3))
    values = read(png(BYTES[..., :1], palette=palette), "made").values
    np.testing.assert_array_equal(np.rint(values * 255.0), palette[BYTES[..., 0]])


def test_palette_with_alpha() -> None:
    # Pillow warns where it drops a transparency that is told for each colour
    picture, stream = Image.fromarray(BYTES).quantize(16), io.BytesIO()
    picture.save(stream, "PNG", transparency=bytes(range(16)))
    opaque = np.asarray(picture.convert("RGBA"))[..., :3]
    np.testing.assert_array_equal(np.rint(read(stream.getvalue(), "made").values * 255.0), opaque)


def test_two_levels() -> None:
    stream = io.BytesIO()
    Image.fromarray(BYTES[..., 0] > 127).save(stream, "PNG")
    np.testing.assert_array_equal(read(stream.getvalue(), "made").values[..., 0], BYTES[..., 0] > 127)


@pytest.mark.parametrize("channels", [1, 3])
def test_jpeg(channels: int, tmp_path: Path, mitsuba_rgb) -> None:
    smooth = np.linspace(0.0, 255.0, 16 * 16 * channels).reshape(16, 16, channels).astype(np.uint8)
    content = jpeg(smooth[..., 0] if channels == 1 else smooth)
    (tmp_path / "x.jpg").write_bytes(content)
    theirs = np.array(mitsuba_rgb.Bitmap(str(tmp_path / "x.jpg"))).reshape(smooth.shape)
    values, integer = read(content, "made")
    assert integer
    # decoders may differ by a level
    np.testing.assert_allclose(values * 255.0, theirs, atol=1.01)


def test_floats_are_linear(data_dir: Path) -> None:
    floats = RNG.normal(size=(5, 4, 3)).astype(np.float32)
    values, integer = read(exr.write(floats), "made")
    assert not integer
    np.testing.assert_array_equal(values, floats)
    radiance = read((data_dir / "env" / "materialx_irradiance_goegap.hdr").read_bytes(), "map")
    assert radiance.values.shape == (128, 256, 3)
    assert not radiance.integer


def claiming(content: bytes, side: int) -> bytes:
    return content[:16] + side.to_bytes(4, "big") * 2 + content[24:]


def cmyk() -> bytes:
    stream = io.BytesIO()
    Image.new("CMYK", (4, 4)).save(stream, "JPEG")
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "not a PNG, JPEG"),
        (b"GIF89a", "not a PNG, JPEG"),
        (b"II*\0", "not a PNG, JPEG"),
        (png(DEEP)[:-40], "not a readable PNG"),
        (png(BYTES)[:20], "not a readable PNG"),
        (claiming(png(BYTES), 2**31 - 1), "not a readable PNG|claims"),
        (jpeg(BYTES[..., :3])[:-60], "not a readable JPEG"),
        (cmyk(), "'CMYK', should be grey or RGB"),
        (exr.MAGIC + b"rest", "cannot be decoded"),
    ],
)
def test_first_wrong_thing_is_named(content: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said) as caught:
        read(content, "made")
    assert "\n" not in str(caught.value)


def test_size_is_refused_before_pixels_are_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("jaxbrdf.data.picture.MOST_PIXELS", 9 * 13 - 1)
    # no pixels follow this header: were they asked for, that would be what is said
    with pytest.raises(DataError, match="claims 9 x 13 pixels"):
        read(png(DEEP)[:80], "made")
