"""Which files of a folder are the maps of one material."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from jaxbrdf.data.os_fault import os_fault
from jaxbrdf.data.texture_name import Convention, Role, TextureName, texture_name
from jaxbrdf.errors import DataError

PICTURES = (".png", ".jpg", ".jpeg", ".exr", ".hdr", ".tif", ".tiff", ".tga", ".bmp", ".webp")
"""Some of these are not read: a map in such a format is refused when it is its turn rather than taken for missing."""

GREEN, BLUE = 1, 2


class TextureFile(NamedTuple):
    """A file and what its name says."""

    path: Path
    name: TextureName


class Channel(NamedTuple):
    """A map of one number: in all channels of a file alike, or in one channel of a packed file."""

    path: Path
    index: int | None = None


class TextureSet(NamedTuple):
    """The files of one material; None for a map that is missing. `told` says what was left aside, a line each."""

    base_color: TextureFile
    normal: TextureFile | None
    roughness: Channel | None
    metallic: Channel | None
    told: tuple[str, ...]


def find(folder: Path, *, normals: Convention | None = None) -> TextureSet:
    """The maps in a folder by their names; of two normal maps the one in the convention `normals`, or OpenGL's.

    Raises:
        DataError: if it is no readable folder, has no base colour, or two files for one map.
    """
    pictures = _pictures(folder)
    named = [TextureFile(path, name) for path in pictures if (name := texture_name(path.stem))]
    base_color = _only(named, "base colour", folder)
    if base_color is None:
        raise DataError(folder, _no_base_colour(folder, pictures))
    normal = _normal(named, normals or "opengl", folder)
    packed = _only(named, "packed", folder)
    roughness = _channel(_only(named, "roughness", folder), packed, GREEN)
    metallic = _channel(_only(named, "metallic", folder), packed, BLUE)
    used = {part.path for part in (base_color, normal, roughness, metallic) if part}
    told = tuple(_left_aside(path) for path in pictures if path not in used)
    return TextureSet(base_color, normal, roughness, metallic, told)


def _pictures(folder: Path) -> list[Path]:
    """Sorted by name; hidden files are none, since macOS leaves one beside each picture in an archive."""
    try:
        if folder.is_file():
            raise DataError(folder, "is a file, not a folder of textures")
        paths = [path for path in folder.iterdir() if path.suffix.lower() in PICTURES and path.name[0] != "."]
    except OSError as error:
        raise DataError(folder, os_fault(error)) from None
    except ValueError as error:
        raise DataError(folder, str(error)) from None
    return sorted(paths)


def _no_base_colour(folder: Path, pictures: list[Path]) -> str:
    if pictures:
        return f"has no base colour: no picture is named *_Color, *_diff or albedo; the first is {pictures[0].name}"
    # as Poly Haven's archives have it
    return f"holds no pictures{', but a folder textures' if (folder / 'textures').is_dir() else ''}"


def _only(named: list[TextureFile], role: Role, folder: Path) -> TextureFile | None:
    return _single([file for file in named if file.name.role == role], role, folder)


def _single(files: list[TextureFile], what: str, folder: Path) -> TextureFile | None:
    if len(files) > 1:
        raise DataError(folder, f"has two files for one map ({what}): {files[0].path.name} and {files[1].path.name}")
    return files[0] if files else None


def _normal(named: list[TextureFile], wanted: Convention, folder: Path) -> TextureFile | None:
    """OpenGL's and DirectX's are one map told twice; any other two are two."""
    files = [file for file in named if file.name.role == "normal"]
    if sorted(file.name.convention or "" for file in files) == ["directx", "opengl"]:
        files = [file for file in files if file.name.convention == wanted]
    return _single(files, "normal", folder)


def _channel(alone: TextureFile | None, packed: TextureFile | None, index: int) -> Channel | None:
    """A map of its own before one in a packed file: Poly Haven gives both, alike."""
    if alone:
        return Channel(alone.path)
    return Channel(packed.path, index) if packed else None


def _left_aside(path: Path) -> str:
    name = texture_name(path.stem)
    if name is None:
        return f"{path.name}: not used, its name tells no map"
    if name.role == "other":
        return f"{path.name}: not used, a metallic-roughness material has no such map"
    return f"{path.name}: not used, another file has its values"
