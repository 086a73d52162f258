"""A folder of textures as the surface that spatially varying models are fitted to, and judged against."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from jaxbrdf.data.pbr import PbrTextures, read_folder, resized
from jaxbrdf.data.texture_name import Convention
from jaxbrdf.surface.textured import surface_of
from jaxbrdf.texture.pyramid import Layout, Pyramid


class Surface(NamedTuple):
    """A spatially varying reference material.

    Attributes:
        name: of the folder.
        maps: the pyramid of `surface.textured.pack`'s channels; the reference itself reads its finest level alone.
        told: what was found out about the files, a line each.
        sha256: of the decoded maps, hexadecimal: the same textures in other files are the same surface.
    """

    name: str
    maps: Pyramid
    told: tuple[str, ...]
    sha256: str

    @property
    def layout(self) -> Layout:
        """Of its texels."""
        return self.maps.layout


def open_surface(
    path: str, *, size: int | None = None, normals: Convention | None = None, resample: bool = False
) -> Surface:
    """The surface in a folder.

    Args:
        path: the folder.
        size: texels along the longer side; by default as many as the files have.
        normals, resample: as `jaxbrdf.data.pbr.read_folder` takes them.

    Raises:
        DataError: as `jaxbrdf.data.pbr.read_folder`.
    """
    textures = read_folder(path, normals=normals, resample=resample)
    return surface_from(Path(path).resolve().name, textures if size is None else resized(textures, size))


def surface_from(name: str, textures: PbrTextures) -> Surface:
    """The surface of textures that are there."""
    layout, material = surface_of(name, textures)
    digest = hashlib.sha256()
    for one in textures[:4]:
        digest.update(np.asarray(one, np.float32).tobytes())
    return Surface(name, Pyramid(layout, jax.block_until_ready(material.params)), textures.told, digest.hexdigest())
