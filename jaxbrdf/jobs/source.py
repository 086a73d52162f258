"""What a command is given: a measured file, a bundle, a fit's folder or the name of a built-in material."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import NamedTuple

from jaxbrdf.brdf import builtin, measured
from jaxbrdf.data import input as data_input
from jaxbrdf.errors import DataError
from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.types import Material

BUNDLE_SUFFIX = ".safetensors"
BUNDLE_NAME = "bundle.safetensors"


class Source(NamedTuple):
    """An opened input.

    Attributes:
        material: evaluable, as the file says it: clamped, not symmetrised.
        path: of the file; None for a built-in material.
        sha256: of a measured file's bytes, hexadecimal; empty for others.
        bundle: set where the file is one.
    """

    material: Material
    path: Path | None
    sha256: str
    bundle: Bundle | None


def open_source(name: str, *, surfaces: bool = False) -> Source:
    """The material that `name` stands for.

    Args:
        name: a file, a fit's folder or a built-in material.
        surfaces: whether a bundle may vary over a surface, so that its queries need texture coordinates.

    Raises:
        DataError: if it is neither a readable file nor a built-in material's name, or a surface that is not wanted.
    """
    if name in builtin.MATERIALS:
        return Source(builtin.MATERIALS[name](), None, "", None)
    path = Path(name)
    if is_bundle(path):
        bundle = open_bundle(name, surfaces=surfaces)
        return Source(bundles.material(bundle), bundle_path(path), "", bundle)
    if path.suffix == "" and not os.path.exists(path):
        raise DataError(name, f"no such file, and not a built-in material ({', '.join(builtin.MATERIALS)})")
    content = data_input.read(path)
    return Source(measured.decode(content, path), path, hashlib.sha256(content).hexdigest(), None)


def is_bundle(path: Path) -> bool:
    """Whether the path looks like a bundle, or like the folder that a fit left one in."""
    return path.suffix == BUNDLE_SUFFIX or os.path.isfile(path / BUNDLE_NAME)


def is_texture_folder(name: str) -> bool:
    """Whether the name is a folder that no fit left a bundle in: one of PBR textures, if anything."""
    return os.path.isdir(name) and not is_bundle(Path(name))


def is_bundle_content(name: str) -> bool:
    """Whether there is a file where the name says that a bundle is."""
    path = Path(name)
    return is_bundle(path) and os.path.isfile(bundle_path(path))


def bundle_path(path: Path) -> Path:
    """The bundle's file, given itself or the folder that a fit wrote."""
    return path / BUNDLE_NAME if os.path.isdir(path) else path


def open_bundle(name: str, *, surfaces: bool = False) -> Bundle:
    """The bundle at a path, as `open_source` takes it.

    Raises:
        DataError: if there is none, or it is not sound, or a surface that is not wanted.
    """
    if name in builtin.MATERIALS:
        raise DataError(name, "is a built-in material; a bundle is needed here")
    path = Path(name)
    if not is_bundle(path):
        raise DataError(name, f"is not a bundle (a {BUNDLE_SUFFIX} file, or a folder with {BUNDLE_NAME})")
    bundle = bundles.load(bundle_path(path))
    if bundle.manifest.is_spatial and not surfaces:
        raise DataError(
            name, f"varies over a surface ({bundle.manifest.model}): what is wanted here is one reflectance"
        )
    return bundle
