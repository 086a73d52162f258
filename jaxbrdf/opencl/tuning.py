"""Which shape of kernel a device runs fastest: from its vector width, and a short trial that is remembered."""

from __future__ import annotations

import json
import subprocess
import sys

import pyopencl as cl

from jaxbrdf.opencl import cache
from jaxbrdf.opencl.platform import devices, identity, is_gpu
from jaxbrdf.opencl.shape import WIDTHS, Shape

GPU_SHAPE = Shape(1, 8)
"""A GPU's lanes are its work items."""

ROWS = (4, 6, 8, 12)
TRIAL_SECONDS = 60.0
VERSION = "3"
"""Of the trial: what an older one found is not asked for."""


def best_shape(device: cl.Device) -> Shape:
    """The shape to compile for the device: measured once, then remembered on disk."""
    if is_gpu(device):
        return GPU_SHAPE
    name = cache.key("shape", VERSION, identity(device))
    found = _remembered(name)
    if found is None:
        times = _measure(device, candidates(device))
        found = min(times, key=lambda shape: times[shape]) if times else candidates(device)[0]
        cache.write(name, json.dumps(found).encode())
    return found


def candidates(device: cl.Device) -> list[Shape]:
    """Shapes worth a trial: vectors as wide as the device's registers and twice that, the likeliest shape first."""
    native = max(device.native_vector_width_float, WIDTHS[1])
    widths = [width for width in WIDTHS if width in (native, 2 * native)]
    return [Shape(width, rows) for width in widths for rows in ROWS]


def narrower(shape: Shape) -> Shape | None:
    """What to try next where the device's compiler refuses a shape."""
    smaller = [width for width in WIDTHS if width < shape.width]
    return Shape(smaller[-1], shape.rows) if smaller else None


def _remembered(name: str) -> Shape | None:
    entry = cache.read(name)
    return None if entry is None else Shape(*json.loads(entry))


def _measure(device: cl.Device, shapes: list[Shape]) -> dict[Shape, float]:
    """The least seconds of each shape that works; after one that crashes its process the rest are tried again."""
    place = devices().index(device)
    while shapes:
        texts = [f"{shape.width},{shape.rows}" for shape in shapes]
        command = [sys.executable, "-m", "jaxbrdf.opencl.trial", str(place), *texts]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=TRIAL_SECONDS, check=False)
        except (OSError, subprocess.TimeoutExpired):
            return {}
        lines = [line.split() for line in done.stdout.splitlines()]
        if done.returncode == 0:
            return _least(shapes, lines)
        begun = [line[0] for line in lines if line and line[0] in texts]
        if not begun:
            return {}
        shapes = [shape for shape, text in zip(shapes, texts, strict=True) if text != begun[-1]]
    return {}


def _least(shapes: list[Shape], lines: list[list[str]]) -> dict[Shape, float]:
    times: dict[Shape, list[float]] = {}
    named = {f"{shape.width},{shape.rows}": shape for shape in shapes}
    for line in lines:
        if len(line) == 2 and line[0] in named:
            times.setdefault(named[line[0]], []).append(float(line[1]))
    return {shape: min(seconds) for shape, seconds in times.items()}
