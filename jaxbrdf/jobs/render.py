"""A picture of a material on a sphere, or of a textured plane."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

from jaxbrdf.data import exr, hdr, png
from jaxbrdf.data import input as data_input
from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.data.pbr import read_folder
from jaxbrdf.errors import DataError, JaxbrdfError
from jaxbrdf.jobs.source import is_texture_folder, open_source
from jaxbrdf.metrics.image import auto_exposure, tonemap
from jaxbrdf.render.environment import Environment, make_environment
from jaxbrdf.render.integrate import render_directional, render_environment
from jaxbrdf.render.plane import PlaneView
from jaxbrdf.render.plane_picture import plane_directional, plane_environment
from jaxbrdf.render.studio import studio
from jaxbrdf.surface.textured import surface_of
from jaxbrdf.types import Material

SUFFIXES = (".exr", ".png")
STUDIO = "studio"
SUN = "sun"
SUN_DIRECTION = (0.5, 0.7, 0.6)
SUN_ON_FLOOR = (0.5, -0.6, 0.7)
"""The same in the frame of a plane that lies on the floor (`jaxbrdf.render.plane`)."""


def render(
    source: str,
    env: str,
    output: str,
    *,
    size: int = 512,
    samples: int = 128,
    seed: int = 0,
    view: PlaneView | None = None,
) -> Path:
    """Renders a material and writes an .exr or .png file, which is returned.

    Args:
        source: a measured file, a bundle or a built-in material; for a plane also a folder of PBR textures.
        env: an .hdr or .exr map, `studio` for the built-in one, or `sun` for a directional light.
        output: its suffix chooses linear EXR or exposed, sRGB-encoded PNG.
        size: pixels a side.
        samples: a pixel.
        seed: of the samples.
        view: of a plane, at any size; without one the material is on a sphere.

    Raises:
        JaxbrdfError: if a file cannot be used.
    """
    path = Path(output)
    if path.suffix not in SUFFIXES:
        raise JaxbrdfError(f"{output}: a picture's name must end in {' or '.join(SUFFIXES)}")
    check_writable(path)
    key = jax.random.key(seed)
    if view is None:
        image = _sphere(key, _untextured(source), env, size, samples)
    else:
        image = _plane(key, source, env, replace(view, height=size, width=size), samples)
    write_atomically(path, encode_image(image, path.suffix))
    return path


def _untextured(source: str) -> Material:
    if is_texture_folder(source):
        raise DataError(source, "is a folder, and no fit's: textures are shown on a plane (--scene plane)")
    return open_source(source).material


def _sphere(key: jax.Array, material: Material, env: str, size: int, samples: int) -> np.ndarray:
    if env == SUN:
        return render_directional(material, SUN_DIRECTION, height=size, width=size)
    return render_environment(key, material, load_environment(env), height=size, width=size, samples=samples)


def _plane(key: jax.Array, source: str, env: str, view: PlaneView, samples: int) -> np.ndarray:
    """The plane, of textures averaged over each pixel's footprint or of one homogeneous material."""
    at_points = is_texture_folder(source)
    if at_points:
        _, material = surface_of(Path(source).resolve().name, read_folder(source))
    else:
        material = open_source(source, surfaces=True).material
    if env == SUN:
        return plane_directional(key, material, view, SUN_ON_FLOOR, samples=samples if at_points else None)
    return plane_environment(key, material, view, load_environment(env), samples=samples, at_points=at_points)


def load_environment(name: str) -> Environment:
    """A map from a file, or the built-in studio.

    Raises:
        DataError: if it cannot be read.
    """
    if name == STUDIO:
        return make_environment(studio())
    path = Path(name)
    readers = {".hdr": hdr.read, ".exr": exr.read}
    if path.suffix not in readers:
        raise DataError(name, f"is not a light: an .hdr or .exr map, {STUDIO} or {SUN}")
    try:
        return make_environment(readers[path.suffix](data_input.read(path), path))
    except ValueError as error:
        raise DataError(name, str(error)) from None


def encode_image(image: np.ndarray, suffix: str) -> bytes:
    """A linear image as a file's content."""
    return exr.write(image) if suffix == ".exr" else png.write(tonemap(image, auto_exposure(image)))
