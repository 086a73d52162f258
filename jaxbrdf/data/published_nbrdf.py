"""The published Neural-BRDF networks of Sztrajman et al. (2021): Keras weights in `.h5` files."""

from __future__ import annotations

import io
import itertools
from os import PathLike
from typing import Any, NamedTuple

import h5py
import numpy as np

from jaxbrdf.errors import DataError

SIZES = (6, 21, 21, 3)
MAGIC = b"\x89HDF\r\n\x1a\n"


class Layer(NamedTuple):
    """A dense layer: x -> x kernel + bias, with kernel `(n, m)` and bias `(m,)`."""

    kernel: np.ndarray
    bias: np.ndarray


def read(content: bytes, path: str | PathLike[str]) -> tuple[Layer, ...]:
    """The three dense layers in the bytes of an `.h5` file, from the input on, float32.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    if content[:8] != MAGIC:
        raise DataError(path, "not an HDF5 file: its signature is missing")
    try:
        with h5py.File(io.BytesIO(content), "r") as file:
            return _layers(file, path)
    except DataError:
        raise
    except Exception as error:  # the library raises whatever its parser met
        raise DataError(path, f"cannot be decoded: {' '.join(str(error).split())}") from None


def _layers(file: Any, path: str | PathLike[str]) -> tuple[Layer, ...]:
    groups = [file[name] for name in _names(file, "layer_names")]
    arrays = [[group[name] for name in _names(group, "weight_names")] for group in groups]
    dense = [pair for pair in arrays if pair]
    shapes = [tuple(array.shape for array in pair) for pair in dense]
    wanted = [((n, m), (m,)) for n, m in itertools.pairwise(SIZES)]
    if shapes != wanted:
        raise DataError(path, f"its layers have the shapes {shapes}, should be {wanted}")
    layers = tuple(Layer(*(np.asarray(array[()], np.float32) for array in pair)) for pair in dense)
    if not all(np.isfinite(array).all() for layer in layers for array in layer):
        raise DataError(path, "a weight is not finite")
    return layers


def _names(group: Any, attribute: str) -> list[str]:
    return [name.decode() if isinstance(name, bytes) else str(name) for name in group.attrs[attribute]]
