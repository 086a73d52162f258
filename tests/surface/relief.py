"""A small surface of waves with varying gloss, on which normals, colours and metal all differ from place to place."""

from __future__ import annotations

from pathlib import Path

import jax
import numpy as np

from jaxbrdf.data.pbr import PbrTextures
from jaxbrdf.surface.textured import surface_of
from jaxbrdf.texture.pyramid import Layout
from tests.writers.png import png


def relief_textures(size: int) -> PbrTextures:
    """Waves of slopes up to 0.6, one period over the texture, half of it a glossy metal."""
    v, u = np.meshgrid(*[(np.arange(size) + 0.5) / size] * 2, indexing="ij")
    slopes = np.stack([0.6 * np.cos(2 * np.pi * u), 0.4 * np.sin(2 * np.pi * v)], axis=-1)
    normal = np.concatenate([-slopes, np.ones((size, size, 1))], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    metallic = (u > 0.5).astype(np.float32)
    base = np.stack([0.2 + 0.6 * u, np.full_like(u, 0.5), 0.8 - 0.6 * v], axis=-1)
    maps = (base, 0.25 + 0.5 * v, metallic, normal)
    return PbrTextures(*(np.asarray(one, np.float32) for one in maps), ("made up",))


def write_relief(folder: Path, size: int) -> None:
    """The waves as files of ambientCG's names, in a new folder."""
    folder.mkdir()
    textures = relief_textures(size)
    maps = {
        "Relief_Color": textures.base_color ** (1 / 2.2),
        "Relief_Roughness": textures.roughness[..., None],
        "Relief_Metalness": textures.metallic[..., None],
        "Relief_NormalGL": 0.5 + 0.5 * textures.normal,
    }
    for name, values in maps.items():
        (folder / f"{name}.png").write_bytes(png(np.rint(255.0 * values).astype(np.uint8)))


def relief(size: int) -> tuple[Layout, jax.Array]:
    """The surface's layout and texels."""
    layout, material = surface_of("relief", relief_textures(size))
    return layout, material.params
