"""Pyramids of latents as OpenEXR pictures, one a level: for programs with a texture system of their own.

`NAME.00.exr` is the finest level. Its channels are half precision and named `latent.00`, `latent.01`, ...; the first
row is v = 0, as docs/conventions.md has it under Textures. A renderer reads each file as a level of one mip map: levels
are trained each by itself, and none is the mean of the one before.
"""

from __future__ import annotations

import os
from os import PathLike
from pathlib import Path

import numpy as np

from jaxbrdf.data import exr
from jaxbrdf.data.os_fault import os_fault
from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import DataError
from jaxbrdf.texture.pyramid import Pyramid, level

LARGEST = float(np.finfo(np.float16).max)


def save_levels(folder: str | PathLike[str], pyramid: Pyramid, *, name: str = "latents") -> list[Path]:
    """Writes every level into the folder, which is made if it is not there, and returns the files, the finest first.

    Texels are rounded to the nearest half: exactly those of a bundle that was stored in float16.

    Raises:
        DataError: if a file cannot be written.
        ValueError: if a texel is not finite or beyond the range of half precision, or `name` is not an identifier.
    """
    if not name.isidentifier():
        raise ValueError(f"name {name!r} is not an identifier")
    largest = float(np.abs(pyramid.texels).max())
    if not largest <= LARGEST:
        raise ValueError(f"a texel of {largest:.3g} is beyond the range of half precision")
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise DataError(folder, os_fault(error)) from None
    paths = [Path(folder) / f"{name}.{number:02d}.exr" for number in range(pyramid.layout.top + 1)]
    for number, path in enumerate(paths):
        write_atomically(path, level_bytes(pyramid, number))
    return paths


def level_bytes(pyramid: Pyramid, number: int) -> bytes:
    """The bytes of one level's `.exr` file.

    Raises:
        ValueError: if there is no such level, or the texels are not of the layout.
    """
    image = np.asarray(level(pyramid.layout, pyramid.texels, number)).astype(np.float16)
    return exr.write_planes({f"latent.{c:02d}": image[..., c] for c in range(image.shape[2])})
