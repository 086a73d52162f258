"""A picture of a material on a sphere."""

from __future__ import annotations

from pathlib import Path

import jax
import numpy as np

from jaxbrdf.data import exr, hdr, png
from jaxbrdf.data import input as data_input
from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.errors import DataError, JaxbrdfError
from jaxbrdf.jobs.source import open_source
from jaxbrdf.metrics.image import auto_exposure, tonemap
from jaxbrdf.render.environment import Environment, make_environment
from jaxbrdf.render.integrate import render_directional, render_environment
from jaxbrdf.render.studio import studio

SUFFIXES = (".exr", ".png")
STUDIO = "studio"
SUN = "sun"
SUN_DIRECTION = (0.5, 0.7, 0.6)


def render(source: str, env: str, output: str, *, size: int = 512, samples: int = 128, seed: int = 0) -> Path:
    """Renders a material and writes an .exr or .png file, which is returned.

    Args:
        source: a measured file, a bundle or a built-in material.
        env: an .hdr or .exr map, `studio` for the built-in one, or `sun` for a directional light.
        output: its suffix chooses linear EXR or exposed, sRGB-encoded PNG.
        size: pixels a side.
        samples: a pixel.
        seed: of the samples.

    Raises:
        JaxbrdfError: if a file cannot be used.
    """
    path = Path(output)
    if path.suffix not in SUFFIXES:
        raise JaxbrdfError(f"{output}: a picture's name must end in {' or '.join(SUFFIXES)}")
    check_writable(path)
    material = open_source(source).material
    if env == SUN:
        image = render_directional(material, SUN_DIRECTION, height=size, width=size)
    else:
        light = load_environment(env)
        image = render_environment(jax.random.key(seed), material, light, height=size, width=size, samples=samples)
    write_atomically(path, encode_image(image, path.suffix))
    return path


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
