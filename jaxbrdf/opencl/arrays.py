"""What a caller hands over on the device: is it what the kernel will read?"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pyopencl as cl
from pyopencl.array import Array

DeviceArray = cl.Buffer | Array

FLOATS = {"wi": 3, "wo": 3, "uv": 2, "footprint": 4, "out": 3}
"""Of a query in each array."""

ROWS = {2: "all u, all v", 3: "all x, all y, all z", 4: "a row for each entry of the footprints"}


class _Place(NamedTuple):
    """Where an array lies: the memory it is part of, and its bytes there."""

    memory: int
    begin: int
    end: int


def queries_in(context: cl.Context, arrays: dict[str, DeviceArray]) -> int:
    """The number of queries in arrays of the context, `out` among them, by their names in `FLOATS`.

    Raises:
        ValueError: naming the array that has the wrong kind, size, dtype or context, or that overlaps `out`.
    """
    places = {name: _place(context, name, array) for name, array in arrays.items()}
    sizes = {name: place.end - place.begin for name, place in places.items()}
    counts = {size / (4 * FLOATS[name]) for name, size in sizes.items()}
    count = counts.pop()
    if counts or count % 1:
        wanted = ", ".join(f"{name} {FLOATS[name]} n" for name in arrays if FLOATS[name] != FLOATS["out"])
        each = f"each must have 3 n floats{', but ' if wanted else ''}{wanted}"
        raise ValueError(f"arrays of {sizes} bytes; {each}, 4 bytes a float")
    for name in arrays:
        if name != "out" and _overlap(places[name], places["out"]):
            raise ValueError(f"out overlaps {name}")
    return int(count)


def rows_of(arrays: dict[str, np.ndarray]) -> list[np.ndarray]:
    """Arrays of the host of one batch shape as contiguous float32, one row a query.

    Raises:
        ValueError: naming the array of another shape.
    """
    shapes = {"uv": (2,), "footprint": (2, 2)}
    batch = arrays["wi"].shape[:-1]
    if arrays["wo"].shape != arrays["wi"].shape or arrays["wi"].shape[-1:] != (3,):
        raise ValueError(f"wi {arrays['wi'].shape} and wo {arrays['wo'].shape} must have one shape (..., 3)")
    for name, array in arrays.items():
        wanted = (*batch, *shapes.get(name, (3,)))
        if array.shape != wanted:
            raise ValueError(f"{name} is {array.shape}, not {wanted}")
    return [np.ascontiguousarray(array, np.float32).reshape(-1, FLOATS[name]) for name, array in arrays.items()]


def check_place(is_spatial: bool, uv: Any, footprint: Any) -> None:
    """Refuses texture coordinates that a material does not read, and a place that it needs and was not told.

    Raises:
        ValueError: naming the argument.
    """
    if not is_spatial and (uv is not None or footprint is not None):
        raise ValueError("uv and footprint are for materials that vary over a surface; this one is the same everywhere")
    if is_spatial and uv is None:
        raise ValueError("uv is None; a material that varies over a surface needs texture coordinates")


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
    rows = FLOATS[name]
    if array.ndim != 2 or array.shape[0] != rows or not array.flags.c_contiguous:
        raise ValueError(f"{name} of shape {array.shape} is not a contiguous ({rows}, n): {ROWS[rows]}")
    if array.offset:
        raise ValueError(f"{name} begins {array.offset} bytes inside its buffer: hand over a copy")


def _overlap(a: _Place, b: _Place) -> bool:
    return a.memory == b.memory and a.begin < b.end and b.begin < a.end
