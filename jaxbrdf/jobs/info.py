"""What a file is, in a few plain fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxbrdf.data.pbr import read_folder
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.json_record import to_plain
from jaxbrdf.jobs.finishing import largest_albedo
from jaxbrdf.jobs.judge import describe_truth
from jaxbrdf.jobs.source import Source, is_texture_folder, open_source


def info(name: str) -> dict[str, Any]:
    """Fields that describe a measured file, a bundle, a built-in material or a folder of textures.

    Raises:
        DataError: if it cannot be read.
    """
    if is_texture_folder(name):
        return _of_textures(Path(name))
    source = open_source(name, surfaces=True)
    return _of_bundle(source.bundle) if source.bundle is not None else _of_material(source)


def _of_material(source: Source) -> dict[str, Any]:
    kind = source.path.suffix.lstrip(".") if source.path else "built-in"
    return {"kind": kind, "sha256": source.sha256, **describe_truth(source)}


def _of_textures(path: Path) -> dict[str, Any]:
    textures = read_folder(path)
    rows, columns = textures.metallic.shape
    lean = np.degrees(np.arccos(np.clip(textures.normal[..., 2], -1.0, 1.0)))
    return {
        "kind": "texture set",
        "name": path.resolve().name,
        "rows": rows,
        "columns": columns,
        "mean_base_color": textures.base_color.mean((0, 1), dtype=np.float64).tolist(),
        "roughness": [float(textures.roughness.min()), float(textures.roughness.max())],
        "metallic": [float(textures.metallic.min()), float(textures.metallic.max())],
        "mean_lean_of_normals_in_degrees": float(lean.mean(dtype=np.float64)),
        "told": list(textures.told),
    }


def _of_bundle(bundle: Bundle) -> dict[str, Any]:
    fields = {name: to_plain(getattr(bundle.manifest, name)) for name in bundle.manifest._fields}
    numbers = int(sum(np.size(leaf) for leaf in jax.tree.leaves(bundle.params)))
    parts = [name for name, part in bundle.parts._asdict().items() if part is not None]
    described = {"isotropic": bundle.manifest.isotropic, "parameters": numbers, "parts": parts}
    if not bundle.manifest.is_spatial:
        described["largest_albedo"] = largest_albedo(bundle)
    return {"kind": "bundle", **described, **fields}
