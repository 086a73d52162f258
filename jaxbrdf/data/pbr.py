"""Texture sets of metallic-roughness materials, a folder each, as ambientCG, Poly Haven and others give them."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import NamedTuple, get_args

import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.colour import srgb_decode
from jaxbrdf.data import input as data_input
from jaxbrdf.data import normal_map, picture, texture_set
from jaxbrdf.data.picture import Picture
from jaxbrdf.data.resampled import resampled
from jaxbrdf.data.texture_name import Convention
from jaxbrdf.data.texture_set import Channel, TextureFile, TextureSet
from jaxbrdf.errors import DataError

DEFAULT_ROUGHNESS = 0.5
DEFAULT_METALLIC = 0.0
TITLES: dict[Convention, str] = {"opengl": "OpenGL", "directx": "DirectX"}

MOST_COLOURED = 0.05
"""How far the channels of a map of one number may lie apart, on average. JPEG leaves a level or two, 0.01."""


class PbrTextures(NamedTuple):
    """The textures of one material, all float32 and of one size, row 0 the top row of the picture.

    Attributes:
        base_color: linear Rec.709 in [0, 1], `(H, W, 3)`.
        roughness: perceptual, in [0, 1], `(H, W)`: the microfacets' alpha is its square.
        metallic: in [0, 1], `(H, W)`.
        normal: unit vectors in the local frame, `(H, W, 3)`: x along u, to the right; y along v, **up** the picture,
            against the rows; z out. This is OpenGL's convention, whatever the file has.
        told: what was found, decided by which rule, set by default and left aside, a line each.
    """

    base_color: np.ndarray
    roughness: np.ndarray
    metallic: np.ndarray
    normal: np.ndarray
    told: tuple[str, ...]


class _Map(NamedTuple):
    """One map and how it came about; no file where it is set by default."""

    values: np.ndarray
    told: tuple[str, ...]
    path: Path | None = None


def read_folder(path: str | PathLike[str], *, normals: Convention | None = None, resample: bool = False) -> PbrTextures:
    """The texture set in a folder, its maps told by their names (`docs/file-formats.md`).

    Args:
        path: the folder.
        normals: the convention of the normal map, over what its name says. Without it the name decides, and where that
            does not say, the map's slopes (`jaxbrdf.data.normal_map`).
        resample: whether maps of other sizes are taken to that of the base colour, by the mean over a texel's area
            where they are larger and bilinearly where they are smaller; otherwise they are refused.

    Raises:
        DataError: if there is no such folder, a map cannot be read or is not what its name says, two files are one
            map, the base colour is missing, sizes differ, or nothing tells the normals' convention.
        ValueError: if `normals` is no convention.
    """
    if normals is not None and normals not in get_args(Convention):
        raise ValueError(f"normals is {normals!r}; should be one of {get_args(Convention)} or None")
    files = texture_set.find(Path(path), normals=normals)
    pictures = {file: picture.read(data_input.read(file), file) for file in _paths(files)}
    base = _base_color(files.base_color, pictures)
    size = base.values.shape[:2]
    maps = (
        _number("roughness", files.roughness, pictures, DEFAULT_ROUGHNESS),
        _number("metallic", files.metallic, pictures, DEFAULT_METALLIC),
        _normals(files.normal, pictures, normals),
    )
    roughness, metallic, normal = (_of_size(one, size, files.base_color.path, resample=resample) for one in maps)
    told = (line for one in (base, roughness, metallic, normal) for line in one.told)
    unit = normal.values / np.linalg.norm(normal.values, axis=-1, keepdims=True)
    return PbrTextures(base.values, roughness.values[..., 0], metallic.values[..., 0], unit, (*told, *files.told))


def _paths(files: TextureSet) -> list[Path]:
    """Each once, the base colour first."""
    parts = (files.base_color, files.roughness, files.metallic, files.normal)
    return list(dict.fromkeys(part.path for part in parts if part))


def _base_color(file: TextureFile, pictures: dict[Path, Picture]) -> _Map:
    values, integer = pictures[file.path]
    rgb = np.broadcast_to(values, (*values.shape[:2], 3))
    said = f"base colour: {file.path.name}"
    if not integer:
        inside, told = _clipped(rgb, f"{said}, floats, which are linear")
    elif file.name.linear:
        inside, told = np.array(rgb), f"{said}, linear by its name"
    else:
        inside, told = np.array(srgb_decode(jnp.asarray(rgb))), f"{said}, decoded from sRGB, which integers are in"
    return _Map(inside, (told,), file.path)


def _number(what: str, channel: Channel | None, pictures: dict[Path, Picture], default: float) -> _Map:
    """A map of one number, `(H, W, 1)`."""
    if channel is None:
        return _Map(np.full((1, 1, 1), default, np.float32), (f"{what}: no map, {default} by default",))
    path, index = channel
    values = pictures[path].values
    if index is None:
        _check_grey(what, values, path)
        said = f"{what}: {path.name}, taken as linear"
    else:
        _check_packed(values, path)
        said = f"{what}: {path.name}, its {('red', 'green', 'blue')[index]} channel, taken as linear"
    inside, told = _clipped(values[..., [index or 0]], said)
    return _Map(inside, (told,), path)


def _check_grey(what: str, values: np.ndarray, path: Path) -> None:
    apart = float(np.mean(np.ptp(values, axis=-1)))
    if apart > MOST_COLOURED:
        raise DataError(path, f"its channels differ by {apart:.2f} on average: it is not {what} alone")


def _check_packed(values: np.ndarray, path: Path) -> None:
    if values.shape[2] != 3:
        raise DataError(path, "is grey, but by its name its channels hold several maps")


def _clipped(values: np.ndarray, said: str) -> tuple[np.ndarray, str]:
    """Within [0, 1], which floats may leave, and what is told of it."""
    outside = float(np.mean((values < 0.0) | (values > 1.0)))
    share = f"; {outside:.2%} of its values lay outside 0 to 1 and were clamped" if outside else ""
    return np.clip(values, 0.0, 1.0), said + share


def _normals(file: TextureFile | None, pictures: dict[Path, Picture], asked: Convention | None) -> _Map:
    if file is None:
        return _Map(np.asarray([[normal_map.FLAT]], np.float32), ("normal: no map, flat by default",))
    opengl, off = normal_map.decode(pictures[file.path].values, file.path)
    chosen, why = _convention(opengl, file, asked)
    told = [f"normal: {file.path.name}, {TITLES[chosen]} {why}"]
    if off:
        told.append(f"normal: {off} of {opengl[..., 0].size} texels are no outward unit vectors, taken by direction")
    return _Map(opengl if chosen == "opengl" else normal_map.flipped(opengl), tuple(told), file.path)


def _convention(opengl: np.ndarray, file: TextureFile, asked: Convention | None) -> tuple[Convention, str]:
    """The convention and the reason, with what the slopes say of it."""
    ratio = normal_map.residual(opengl)
    seen = normal_map.convention(opengl, ratio)
    slopes = f"curl as OpenGL / as DirectX = {ratio:.3g}"
    stated = asked or file.name.convention
    if stated:
        doubt = "" if seen in (None, stated) else f", though its slopes look like {TITLES[seen]}"
        return stated, f"{'as asked' if asked else 'by its name'}{doubt} ({slopes})"
    if seen is None:
        raise DataError(file.path, f"nothing tells whether it is OpenGL's or DirectX's ({slopes}): give normals=")
    return seen, f"by its slopes ({slopes})"


def _of_size(one: _Map, size: tuple[int, int], base: Path, *, resample: bool) -> _Map:
    height, width = one.values.shape[:2]
    if one.path is None:
        return one._replace(values=np.array(np.broadcast_to(one.values, (*size, one.values.shape[2]))))
    if (height, width) == size:
        return one
    if not resample:
        raise DataError(
            one.path, f"is {height} x {width}, but {base.name} is {size[0]} x {size[1]}: resample=True takes it to that"
        )
    told = f"{one.path.name}: resampled from {height} x {width} to {size[0]} x {size[1]}"
    return _Map(resampled(one.values, size), (*one.told, told), one.path)


def resized(textures: PbrTextures, size: int) -> PbrTextures:
    """The textures with `size` texels along their longer side, means over what each new texel covers.

    Raises:
        ValueError: if `size` is not positive.
    """
    if size < 1:
        raise ValueError(f"size is {size}; it must be positive")
    height, width = textures.metallic.shape
    shape = (max(1, round(height * size / max(height, width))), max(1, round(width * size / max(height, width))))
    if shape == (height, width):
        return textures
    grey = (
        resampled(textures.roughness[..., None], shape)[..., 0],
        resampled(textures.metallic[..., None], shape)[..., 0],
    )
    normal = resampled(textures.normal, shape)
    length = np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), np.finfo(np.float32).tiny)
    told = f"resampled from {height} x {width} to {shape[0]} x {shape[1]} texels"
    return PbrTextures(resampled(textures.base_color, shape), *grey, normal / length, (*textures.told, told))
