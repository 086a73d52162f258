from __future__ import annotations

import numpy as np
import pytest

from jaxbrdf.data.utia import SHAPE, Utia, read, write
from jaxbrdf.errors import DataError

NUMBERS = 3 * 288 * 288


def test_written_table_is_read_back() -> None:
    table = Utia(np.random.default_rng(0).normal(0.3, 0.2, (*SHAPE, 3)))
    content = write(table)
    assert len(content) == 8 * NUMBERS
    np.testing.assert_array_equal(read(content, "made").rgb, table.rgb)


def test_layout() -> None:
    planes = np.zeros((3, 288, 288))
    planes[1, 48 * 2 + 5, 48 * 4 + 7] = 0.25
    rgb = read(planes.tobytes(), "made").rgb
    assert rgb[2, 5, 4, 7, 1] == 0.25
    assert np.count_nonzero(rgb) == 1


def test_single_precision_is_told_by_its_size() -> None:
    planes = np.random.default_rng(1).random(NUMBERS).astype("<f4")
    np.testing.assert_array_equal(read(planes.tobytes(), "made").rgb, read(planes.astype("<f8").tobytes(), "made").rgb)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "has 0 bytes"),
        (np.ones(NUMBERS).tobytes()[:-8], "bytes where"),
        (np.ones(NUMBERS + 1).tobytes(), "bytes where"),
        (np.zeros(NUMBERS).tobytes(), "no cell is above zero"),
        (np.append(np.ones(NUMBERS - 1), np.nan).tobytes(), r"cell \[5, 47, 5, 47\] of plane 2 is not finite"),
        (np.append(-np.inf, np.ones(NUMBERS - 1)).tobytes(), r"cell \[0, 0, 0, 0\] of plane 0 is not finite"),
    ],
)
def test_first_wrong_thing_is_named(content: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said):
        read(content, "made.bin")


def test_writer_refuses_what_cannot_be_stored() -> None:
    with pytest.raises(ValueError, match="should be"):
        write(Utia(np.ones((6, 48, 6, 48))))
    with pytest.raises(ValueError, match="not finite"):
        write(Utia(np.full((*SHAPE, 3), np.nan)))
