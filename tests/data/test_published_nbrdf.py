from __future__ import annotations

import io
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pytest

from jaxbrdf.data.published_nbrdf import SIZES, read
from jaxbrdf.errors import DataError


def network(sizes: tuple[int, ...] = SIZES, bias: float = 0.0, dtype: str = "f4") -> bytes:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        names = [f"dense_{i}" for i in range(len(sizes) - 1)]
        file.attrs["layer_names"] = [name.encode() for name in [*names, "lambda_1"]]
        file.create_group("lambda_1").attrs["weight_names"] = np.zeros(0)
        for name, rows, columns in zip(names, sizes, sizes[1:], strict=False):
            group = file.create_group(name)
            group.attrs["weight_names"] = [f"{name}/kernel:0".encode(), f"{name}/bias:0".encode()]
            group[f"{name}/kernel:0"] = np.ones((rows, columns), dtype)
            group[f"{name}/bias:0"] = np.full(columns, bias, dtype)
    return stream.getvalue()


@pytest.mark.parametrize(("archive", "count"), [("merl", 100), ("rgl-isotropic", 51)])
def test_every_published_network_is_read(archive: str, count: int, data_dir: Path) -> None:
    with zipfile.ZipFile(data_dir / "nbrdf" / f"{archive}_nbrdf.zip") as members:
        names = [name for name in members.namelist() if name.endswith(".h5")]
        layers = [read(members.read(name), name) for name in names]
    assert len(names) == count
    assert all([layer.kernel.shape for layer in three] == [(6, 21), (21, 21), (21, 3)] for three in layers)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\x89HDF", "signature"),
        (network()[:500], "cannot be decoded"),
        (network((6, 21, 3)), "its layers have the shapes"),
        (network((6, 14, 21, 3)), "its layers have the shapes"),
        (network(bias=np.nan), "not finite"),
    ],
)
def test_first_wrong_thing_is_named(content: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said) as caught:
        read(content, "made.h5")
    assert "\n" not in str(caught.value)


def test_file_without_layers_is_refused() -> None:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file["something"] = 1.0
    with pytest.raises(DataError, match="cannot be decoded"):
        read(stream.getvalue(), "made")
