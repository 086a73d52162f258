"""Cut, padded and corrupted files end in a `DataError`, or in arrays that are finite: never in anything else."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxbrdf.data import exr, hdr, input, ior, merl, picture, png, published_nbrdf, rgl, utia
from jaxbrdf.errors import DataError
from tests.writers.png import png as deep_png

NETWORK = "nbrdf/rgl-isotropic_nbrdf.zip/paper_white_rgb.h5"
READERS: dict[str, Callable] = {
    "rgl": rgl.read,
    "merl": merl.read,
    "utia": utia.read,
    "hdr": hdr.read,
    "exr": exr.read,
    "png": png.read,
    "deep png": picture.read,
    "jpeg": picture.read,
    "nbrdf": published_nbrdf.read,
    "ior": ior.read,
}
HEADERS = {"rgl": 600, "merl": 12, "hdr": 100, "ior": 900, "jpeg": 700}
"""Bytes at the start where damage does most; elsewhere the whole file."""


@cache
def intact(kind: str, folder: Path) -> bytes:
    rng = np.random.default_rng(0)
    match kind:
        case "rgl":
            return input.read(folder / "rgl" / "paper_white_rgb.bsdf")
        case "hdr":
            return input.read(folder / "env" / "materialx_irradiance_goegap.hdr")[:20000]
        case "nbrdf":
            return input.read(folder / NETWORK)
        case "ior":
            return input.read(folder / "ior" / "main_Au_nk_Johnson.yml")
        case "exr":
            return exr.write(rng.random((9, 12, 3)).astype(np.float32))
        case "png":
            return png.write(rng.random((9, 12, 3)))
        case "deep png":
            return deep_png(rng.integers(0, 65536, (9, 12, 3), np.uint16))
        case "jpeg":
            return input.read(folder / "textures" / "Metal049A" / "Metal049A_1K-JPG_Metalness.jpg")
        case "utia":
            return utia.write(utia.Utia(rng.random((*utia.SHAPE, 3))))
    return merl.write(merl.Merl(rng.random((*merl.SHAPE, 3)), np.ones(merl.SHAPE, bool)))


def arrays(result: object) -> list[np.ndarray]:
    if isinstance(result, np.ndarray):
        return [result]
    return [a for part in result for a in arrays(part)] if isinstance(result, tuple) else []


def outcome(kind: str, content: bytes) -> list[np.ndarray] | str:
    """What was read, or the line that refuses it; any other exception passes."""
    try:
        return arrays(READERS[kind](content, "damaged"))
    except DataError as error:
        return str(error)


def assert_refused_or_finite(kind: str, content: bytes) -> None:
    found = outcome(kind, content)
    if isinstance(found, str):
        assert found.startswith("damaged: ")
        assert "\n" not in found
    else:
        assert all(np.isfinite(array).all() for array in found)


@pytest.mark.parametrize("kind", READERS)
@settings(max_examples=25)
@given(data=st.data())
def test_damaged_bytes(kind: str, data_dir: Path, data: st.DataObject) -> None:
    content = bytearray(intact(kind, data_dir))
    whole = st.integers(0, len(content) - 1)
    early = st.integers(0, min(HEADERS.get(kind, len(content)), len(content)) - 1)
    places = data.draw(st.lists(st.one_of(early, whole), min_size=1, max_size=8))
    for place in places:
        content[place] = data.draw(st.integers(0, 255))
    assert_refused_or_finite(kind, bytes(content))


@pytest.mark.parametrize("kind", READERS)
@settings(max_examples=15)
@given(share=st.floats(0.0, 1.0, exclude_max=True))
def test_cut_file(kind: str, data_dir: Path, share: float) -> None:
    content = intact(kind, data_dir)
    assert_refused_or_finite(kind, content[: int(share * len(content))])


@pytest.mark.parametrize("kind", ["rgl", "merl", "utia"])
@settings(max_examples=5)
@given(padding=st.binary(min_size=1, max_size=64))
def test_padded_measurement_is_refused(kind: str, data_dir: Path, padding: bytes) -> None:
    with pytest.raises(DataError, match="bytes"):
        READERS[kind](intact(kind, data_dir) + padding, "padded")


@pytest.mark.parametrize("kind", READERS)
@settings(max_examples=15)
@given(content=st.binary(max_size=200))
def test_arbitrary_bytes(kind: str, content: bytes) -> None:
    with pytest.raises(DataError):
        READERS[kind](content, "arbitrary")
