from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from jaxbrdf.data.png import read, write
from jaxbrdf.errors import DataError

PIXELS = np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8)


def png(picture: Image.Image) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    return stream.getvalue()


def test_written_picture_is_read_back() -> None:
    np.testing.assert_array_equal(read(write(PIXELS), "made"), PIXELS)


def test_mitsuba_reads_what_is_written(tmp_path: Path, mitsuba_rgb) -> None:
    (tmp_path / "x.png").write_bytes(write(PIXELS))
    np.testing.assert_array_equal(np.array(mitsuba_rgb.Bitmap(str(tmp_path / "x.png"))), PIXELS)


def test_numbers_are_rounded_and_clamped() -> None:
    values = np.array([[[-1.0, 0.5, 2.0], [0.0, 1.0, 127.4 / 255.0]]])
    np.testing.assert_array_equal(read(write(values), "made"), [[[0, 128, 255], [0, 255, 127]]])


def test_grey_and_alpha_become_rgb() -> None:
    grey = PIXELS[..., 0]
    np.testing.assert_array_equal(read(png(Image.fromarray(grey)), "made"), np.repeat(grey[..., None], 3, axis=-1))
    both = np.concatenate([PIXELS, PIXELS[..., :1]], axis=-1)
    np.testing.assert_array_equal(read(png(Image.fromarray(both)), "made"), PIXELS)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"GIF89a", "not a readable PNG"),
        (write(PIXELS)[:-30], "not a readable PNG"),
        (write(PIXELS)[:16] + b"\x7f\xff\xff\xff" * 2 + write(PIXELS)[24:], "not a readable PNG|claims"),
        (png(Image.fromarray(np.zeros((2, 2), np.uint16))), "8 bits"),
    ],
)
def test_first_wrong_thing_is_named(content: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said):
        read(content, "made.png")


def test_writer_refuses_what_is_no_picture() -> None:
    with pytest.raises(ValueError, match="should be"):
        write(PIXELS[..., 0])
    with pytest.raises(ValueError, match="not a number"):
        write(np.full((1, 1, 3), np.nan))
