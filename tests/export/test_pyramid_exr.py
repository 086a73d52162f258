"""Levels as EXR files, read back by the OpenEXR library itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from jaxbrdf.errors import DataError
from jaxbrdf.export.pyramid_exr import save_levels
from jaxbrdf.texture.pyramid import Layout, Pyramid

LAYOUT = Layout(6, 9)
SIZES = [(6, 9), (3, 4), (1, 2), (1, 1)]


def pyramid(channels: int) -> Pyramid:
    texels: Any = np.random.default_rng(0).normal(size=(LAYOUT.texels, channels)).astype(np.float32)
    return Pyramid(LAYOUT, texels)


@pytest.mark.parametrize("channels", [1, 8, 11])
def test_every_level_is_a_file_of_halves(channels: int, tmp_path: Path):
    made = pyramid(channels)
    files = save_levels(tmp_path / "new", made)
    assert [file.name for file in files] == [f"latents.0{n}.exr" for n in range(4)]
    start = 0
    for file, (rows, columns) in zip(files, SIZES, strict=True):
        read = OpenEXR.File(str(file), separate_channels=True).channels()
        assert sorted(read) == [f"latent.{c:02d}" for c in range(channels)]
        assert all(channel.pixels.dtype == np.float16 for channel in read.values())
        found = np.stack([read[name].pixels for name in sorted(read)], axis=-1)
        # the first texel of a level is the left one of its top row
        wanted = made.texels[start : start + rows * columns].reshape(rows, columns, channels).astype(np.float16)
        np.testing.assert_array_equal(found, wanted)
        start += rows * columns
    assert start == LAYOUT.texels


@pytest.mark.parametrize("bad", [7e4, np.nan, -np.inf])
def test_what_half_precision_does_not_hold_is_refused(bad: float, tmp_path: Path):
    made = pyramid(3)
    np.asarray(made.texels)[5, 1] = bad
    with pytest.raises(ValueError, match="beyond the range of half precision"):
        save_levels(tmp_path, made)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_made_is_told_in_one_line(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(DataError, match="file"):
        save_levels(tmp_path / "file", pyramid(1))
    with pytest.raises(ValueError, match="is not an identifier"):
        save_levels(tmp_path, pyramid(1), name="../a")
