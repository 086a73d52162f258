"""What a file is, in a few plain fields."""

from __future__ import annotations

from typing import Any

import jax
import numpy as np

from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.json_record import to_plain
from jaxbrdf.jobs.finishing import largest_albedo
from jaxbrdf.jobs.judge import describe_truth
from jaxbrdf.jobs.source import Source, open_source


def info(name: str) -> dict[str, Any]:
    """Fields that describe a measured file, a bundle or a built-in material.

    Raises:
        DataError: if it cannot be read.
    """
    source = open_source(name)
    return _of_bundle(source.bundle) if source.bundle is not None else _of_material(source)


def _of_material(source: Source) -> dict[str, Any]:
    kind = source.path.suffix.lstrip(".") if source.path else "built-in"
    return {"kind": kind, "sha256": source.sha256, **describe_truth(source)}


def _of_bundle(bundle: Bundle) -> dict[str, Any]:
    fields = {name: to_plain(getattr(bundle.manifest, name)) for name in bundle.manifest._fields}
    numbers = int(sum(np.size(leaf) for leaf in jax.tree.leaves(bundle.params)))
    parts = [name for name, part in bundle.parts._asdict().items() if part is not None]
    described = {"isotropic": bundle.manifest.isotropic, "parameters": numbers, "parts": parts}
    return {"kind": "bundle", **described, "largest_albedo": largest_albedo(bundle), **fields}
