from __future__ import annotations

import struct

import numpy as np
import pytest

from jaxbrdf.data.merl import CELLS, SHAPE, SIZE, Merl, read, write
from jaxbrdf.errors import DataError


@pytest.fixture(scope="module")
def table() -> Merl:
    rng = np.random.default_rng(0)
    valid = rng.random(SHAPE) < 0.9
    return Merl(np.where(valid[..., None], rng.random((*SHAPE, 3)), 0.0), valid)


def raw(value: float, **cells: float) -> bytes:
    planes = np.full(3 * CELLS, value, "<f8")
    for place, other in cells.items():
        planes[int(place[1:])] = other
    return struct.pack("<3i", *SHAPE) + planes.tobytes()


def test_written_table_is_read_back(table: Merl) -> None:
    content = write(table)
    assert len(content) == SIZE
    back = read(content, "made")
    np.testing.assert_allclose(back.rgb, table.rgb, rtol=1e-15)
    np.testing.assert_array_equal(back.valid, table.valid)
    assert write(back) == content


def test_layout_scales_and_invalid_cells() -> None:
    cell = (3 * 90 + 2) * 180 + 7
    content = raw(15.0, **{f"_{cell}": 1500.0, f"_{cell + CELLS}": 3000.0, "_5": -1.0})
    table = read(content, "made")
    np.testing.assert_allclose(table.rgb[3, 2, 7], [1.0, 2.0 * 1.15, 0.01 * 1.66])
    assert not table.valid[0, 0, 5]
    assert table.valid.sum() == CELLS - 1
    np.testing.assert_array_equal(table.rgb[0, 0, 5], 0.0)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "0 bytes"),
        (b"\0" * 12, r"\[0, 0, 0\]"),
        (struct.pack("<3i", 90, 90, 360), r"\[90, 90, 360\]"),
        (struct.pack("<3i", 2048, 1024, 1024), "2048"),
        (struct.pack("<3i", *SHAPE), "has 12 bytes"),
        (raw(1.0)[:-1], "bytes where"),
        (raw(1.0) + b"\0", "bytes where"),
        (raw(1.0, _7=np.nan), r"cell \[0, 0, 7\] of channel 0 is not finite"),
        (raw(1.0, _1458000=np.inf), r"cell \[0, 0, 0\] of channel 1"),
        (raw(1.0, _1=1e300), "not finite"),
        (raw(0.0), "no valid cell"),
        (raw(-1.0), "no valid cell"),
    ],
)
def test_first_wrong_thing_is_named(content: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said):
        read(content, "made.binary")


def test_writer_refuses_what_cannot_be_stored(table: Merl) -> None:
    with pytest.raises(ValueError, match=r"table\.rgb is"):
        write(table._replace(rgb=table.rgb[:1]))
    for bad in (np.nan, np.inf, -1.0):
        rgb = table.rgb.copy()
        rgb[tuple(np.argwhere(table.valid)[0])] = bad
        with pytest.raises(ValueError, match="negative or not finite"):
            write(table._replace(rgb=rgb))
