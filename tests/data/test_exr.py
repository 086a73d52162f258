"""EXR pictures against Mitsuba, which reads what is written here and writes what is read here."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from jaxbrdf.data.exr import read, write
from jaxbrdf.errors import DataError


@pytest.fixture(scope="module")
def picture() -> np.ndarray:
    values = np.random.default_rng(0).normal(size=(7, 11, 3)).astype(np.float32)
    values[0, 0] = 2e5, 0.0, 1e-30
    return values


def test_written_picture_is_read_back_exactly(picture: np.ndarray) -> None:
    np.testing.assert_array_equal(read(write(picture), "made"), picture)


def test_half_precision_stays_half(picture: np.ndarray) -> None:
    half = np.clip(picture, -6e4, 6e4).astype(np.float16)
    assert len(write(half)) < len(write(picture))
    np.testing.assert_array_equal(read(write(half), "made"), half.astype(np.float32))


def test_mitsuba_reads_what_is_written(picture: np.ndarray, tmp_path: Path, mitsuba_rgb) -> None:
    (tmp_path / "x.exr").write_bytes(write(picture))
    np.testing.assert_array_equal(np.array(mitsuba_rgb.Bitmap(str(tmp_path / "x.exr"))), picture)


@pytest.mark.parametrize("alpha", [False, True])
def test_mitsuba_s_picture_is_read(alpha: bool, picture: np.ndarray, tmp_path: Path, mitsuba_rgb) -> None:
    theirs = np.concatenate([picture, picture[..., :1]], axis=-1) if alpha else picture
    mitsuba_rgb.Bitmap(theirs).write(str(tmp_path / "x.exr"))
    np.testing.assert_array_equal(read((tmp_path / "x.exr").read_bytes(), "made"), picture)


def exr(channels: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    OpenEXR.File({"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}, channels).write(stream)
    return stream.getvalue()


def test_grey_picture_has_three_equal_channels() -> None:
    grey = np.arange(6, dtype=np.float32).reshape(2, 3)
    np.testing.assert_array_equal(read(exr({"Y": grey}), "made"), np.repeat(grey[..., None], 3, axis=-1))


def claiming(content: bytes, side: int) -> bytes:
    start = content.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    return content[:start] + struct.pack("<4i", 0, 0, side - 1, side - 1) + content[start + 16 :]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda _: b"\x89PNG", "not an OpenEXR picture"),
        (lambda c: c[:60], "cannot be decoded"),
        (lambda c: c[:-20], "cannot be decoded"),
        (lambda c: claiming(c, 2**20), "claims 1048576 x 1048576 pixels|cannot be decoded"),
        (lambda c: claiming(c, 2**14), "claims 16384 x 16384 pixels"),
        (lambda _: exr({"depth": np.ones((2, 2), np.float32)}), "depth"),
        (lambda _: exr({"Y": np.array([[1.0, np.nan]], np.float32)}), "not finite"),
    ],
)
def test_first_wrong_thing_is_named(change, said: str, picture: np.ndarray) -> None:
    with pytest.raises(DataError, match=said) as caught:
        read(change(write(picture)), "made.exr")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("shape", [(2, 3), (2, 3, 4), (0, 3, 3)])
def test_writer_refuses_other_shapes(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="should be"):
        write(np.zeros(shape))
