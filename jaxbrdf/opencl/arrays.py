"""What a caller hands over on the device: is it what the kernel will read?"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pyopencl as cl
from pyopencl.array import Array

DeviceArray = cl.Buffer | Array

BYTES = 12
"""Of a direction or a colour."""


class _Place(NamedTuple):
    """Where an array lies: the memory it is part of, and its bytes there."""

    memory: int
    begin: int
    end: int


def queries_in(context: cl.Context, wi: DeviceArray, wo: DeviceArray, out: DeviceArray) -> int:
    """The number of queries in arrays `(3, n)` of the context.

    Raises:
        ValueError: naming the array that has the wrong kind, size, dtype or context, or that overlaps `out`.
    """
    named = {"wi": wi, "wo": wo, "out": out}
    places = {name: _place(context, name, array) for name, array in named.items()}
    sizes = {name: place.end - place.begin for name, place in places.items()}
    if len(set(sizes.values())) > 1 or sizes["out"] % BYTES:
        raise ValueError(f"arrays of {sizes} bytes; each must have 3 n floats, {BYTES} bytes a query")
    for name in ("wi", "wo"):
        if _overlap(places[name], places["out"]):
            raise ValueError(f"out overlaps {name}")
    return sizes["out"] // BYTES


def _place(context: cl.Context, name: str, array: DeviceArray) -> _Place:
    if isinstance(array, Array):
        _check_array(name, array)
        return _place(context, name, array.data)  # pyright: ignore[reportArgumentType]
    if not isinstance(array, cl.Buffer):
        raise ValueError(f"{name} is a {type(array).__name__}, not a buffer or an array on the device")
    if array.get_info(cl.mem_info.CONTEXT) != context:
        raise ValueError(f"{name} belongs to another context than the material")
    parent: Any = array.get_info(cl.mem_info.ASSOCIATED_MEMOBJECT)
    begin: Any = 0 if parent is None else array.get_info(cl.mem_info.OFFSET)
    whole: Any = parent or array
    return _Place(whole.int_ptr, begin, begin + array.size)


def _check_array(name: str, array: Array) -> None:
    if array.dtype != np.float32:
        raise ValueError(f"{name} is {array.dtype}, not float32")
    if array.ndim != 2 or array.shape[0] != 3 or not array.flags.c_contiguous:
        raise ValueError(f"{name} of shape {array.shape} is not a contiguous (3, n): all x, all y, all z")
    if array.offset:
        raise ValueError(f"{name} begins {array.offset} bytes inside its buffer: hand over a copy")


def _overlap(a: _Place, b: _Place) -> bool:
    return a.memory == b.memory and a.begin < b.end and b.begin < a.end
