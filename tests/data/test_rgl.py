"""What the RGL reader accepts and refuses; values are judged in tests/brdf/test_rgl.py."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from jaxbrdf.data import tensor_file
from jaxbrdf.data.rgl import read
from jaxbrdf.errors import DataError
from tests.writers import rgl as writer


def changed(**fields) -> bytes:
    return writer.tensor_file(writer.fields() | fields)


def with_value(name: str, value: float) -> bytes:
    array = writer.fields()[name].copy()
    array.flat[3] = value
    return changed(**{name: array})


def test_real_file(data_dir: Path) -> None:
    data = read((data_dir / "rgl" / "irid_flake_paint1_fine_rgb.bsdf").read_bytes(), "made")
    assert data.description.startswith("Iridescent flake car paint")
    assert (data.vndf.shape, data.rgb.shape) == ((1, 8, 128, 128), (1, 8, 3, 48, 48))
    assert data.isotropic
    assert data.jacobian


def test_container_gives_back_what_was_written() -> None:
    fields = writer.fields(azimuths=5)
    arrays = tensor_file.read(writer.tensor_file(fields), "made")
    assert arrays.keys() == fields.keys()
    for name, array in fields.items():
        np.testing.assert_array_equal(arrays[name], array)
        assert arrays[name].dtype == array.dtype


@pytest.mark.parametrize("length", [0, 5, 13, 17, 19, 40, 300, 1000])
def test_truncated_file_is_refused(length: int) -> None:
    with pytest.raises(DataError, match=r"made\.bsdf: "):
        read(writer.tensor_file(writer.fields())[:length], "made.bsdf")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"tensor file\0" + bytes(20), "tensor_file"),
        (b"tensor_file\0" + struct.pack("<BBI", 2, 0, 0), "version 2.0"),
        (changed() + b"\0", "1 bytes follow"),
        (b"tensor_file\0" + struct.pack("<BBIH1sHBQ", 1, 0, 1, 1, b"x", 1, 99, 0), "type code 99"),
        (b"tensor_file\0" + struct.pack("<BBIH1sHBQ", 1, 0, 1, 1, b"x", 60000, 10, 0), "rank 60000"),
        (b"tensor_file\0" + struct.pack("<BBIH1sHBQQ", 1, 0, 1, 1, b"x", 1, 10, 0, 2**31), "needs 8589934592 bytes"),
        (b"tensor_file\0" + struct.pack("<BBIH1sHBQQQ", 1, 0, 1, 1, b"x", 2, 10, 0, 0, 2**63), "empty"),
        (b"tensor_file\0" + struct.pack("<BBIH1sHBQQ", 1, 0, 1, 1, b"x", 1, 10, 2**63, 1), "0 are left"),
        (b"tensor_file\0" + struct.pack("<BBI", 1, 0, 2**32 - 1), "cut off"),
        (b"tensor_file\0" + struct.pack("<BBI", 1, 0, 0), "'phi_i' is missing"),
        (changed(vndf=np.ones((1, 4, 12), np.float32)), "'vndf' has shape"),
        (changed(luminance=np.ones((1, 3, 8, 8), np.float32)), "'luminance' has shape"),
        (changed(rgb=np.ones((1, 4, 3, 8, 9), np.float32)), "'rgb' has shape"),
        (changed(ndf=np.ones((6, 1), np.float32)), "too small"),
        (changed(theta_i=np.array([0, 1, 1, 2], np.float32)), "does not increase"),
        (changed(sigma=np.ones((6, 10), np.uint32)), "'sigma' is uint32"),
        (with_value("rgb", np.nan), "not finite at"),
        (with_value("vndf", np.inf), "not finite at"),
        (with_value("luminance", -1.0), "negative"),
        (with_value("ndf", -1.0), "negative"),
        (changed(vndf=np.zeros((1, 4, 12, 16), np.float32)), "zero everywhere"),
        (changed(sigma=np.zeros((6, 10), np.float32)), "zero everywhere"),
        (changed(rgb=np.zeros((1, 4, 3, 8, 8), np.float32)), "zero everywhere"),
    ],
)
def test_first_wrong_thing_is_named(content: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said) as caught:
        read(content, "made.bsdf")
    assert str(caught.value).startswith("made.bsdf: ")
    assert "\n" not in str(caught.value)


def test_spectra_outside_the_visible_are_refused() -> None:
    content = writer.tensor_file(writer.fields(wavelengths=np.array([900.0, 1000.0])))
    with pytest.raises(DataError, match="no wavelength lies between 360 and 780 nm"):
        read(content, "made")


def test_spectra_too_large_for_rgb_are_refused() -> None:
    fields = writer.fields(wavelengths=np.linspace(400, 700, 4))
    red = np.zeros((1, 4, 4, 8, 8), np.float32)
    red[:, :, 2:] = 3.4e38
    content = writer.tensor_file(fields | {"spectra": red})
    with pytest.raises(DataError, match="too large"):
        read(content, "made")


@pytest.mark.parametrize(
    "nanometres", [np.linspace(360, 1000, 195), np.array([400.0, 500.0, 650.0]), np.array([555.0])]
)
def test_flat_unit_spectrum_is_white(nanometres: np.ndarray) -> None:
    fields = writer.fields(wavelengths=nanometres)
    flat = np.ones((1, 4, len(nanometres), 8, 8), np.float32)
    np.testing.assert_allclose(read(writer.tensor_file(fields | {"spectra": flat}), "made").rgb, 1.0, atol=1e-6)
