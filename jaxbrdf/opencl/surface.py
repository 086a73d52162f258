"""The numbers that the kernels of models over a surface read, in the forms that they read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from jaxbrdf.export.bundle import Bundle
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.models.shading_frame import NUMBERS
from jaxbrdf.models.warp import LEAST_EXPONENT
from jaxbrdf.texture.pyramid import Layout

LOG2_E = float(np.log2(np.e))
"""Kernels compute 2^x: hidden layers give -log2(e) x, which SiLU needs, and the last one log2(f)."""

BLOCK = 8
"""Channels that a lookup reads at once: texels are padded to whole blocks."""


class Prepared(NamedTuple):
    """Macros, and what is to be written by the name of its place."""

    macros: dict[str, str]
    fields: dict[str, Any]


def prepared(bundle: Bundle, fields: Mapping[str, Any]) -> Prepared:
    """What the kernel reads in place of a model's parameters.

    Args:
        bundle: of a model over a surface.
        fields: its parameters by name, as numpy arrays.
    """
    return PREPARED[bundle.manifest.model](bundle.manifest.config, fields)


def _gated(config: Any, fields: Mapping[str, Any]) -> Prepared:
    """Matrices with whole rows, and one map for all that is decoded from latents."""
    own = _with_angular_textures(config, fields)
    macros, h, d = own.macros, own.fields["h"], own.fields["d"]
    if config.gating:
        macros = macros | {"JB_GATING": str(config.textures.channels)}
        h, d = (_whole_rows(texture, config.latents.channels) for texture in (h, d))
    decoded, places = _decoded(fields["frame"], fields["warps"])
    changed = {"h": h, "d": d, "decoded": decoded, "frame": None, "warps": None}
    return Prepared(macros | places, own.fields | changed)


def _with_angular_textures(config: Any, fields: Mapping[str, Any]) -> Prepared:
    own = _with_latents(config, fields)
    return own._replace(fields=own.fields | {name: _with_azimuth(fields[name]) for name in ("h", "d")})


def _with_frames(config: Any, fields: Mapping[str, Any]) -> Prepared:
    own, map_ = _with_latents(config, fields), np.asarray(fields["frame"])
    layer: Any = (map_,), (np.zeros(map_.shape[1]),)
    macros = own.macros | {"JB_FRAME_COUNT": str(config.frames)}
    return Prepared(macros, own.fields | {"frame": Mlp(*layer)})


def _with_offset(config: Any, fields: Mapping[str, Any]) -> Prepared:
    own, latents = _with_latents(config, fields), config.offset_latents
    macros = own.macros | _layout_macros("OFFSET", latents.layout, latents.channels)
    return Prepared(macros, own.fields | {"offset": padded(np.asarray(fields["offset"].texels))})


def _with_latents(config: Any, fields: Mapping[str, Any]) -> Prepared:
    latents = config.latents
    macros = _layout_macros("S", latents.layout, latents.channels) | {"JB_PROBES": str(latents.probes)}
    return Prepared(macros, {**fields, "s": padded(np.asarray(fields["s"].texels))})


PREPARED: dict[str, Callable[[Any, Mapping[str, Any]], Prepared]] = {
    "spatial-gated": _gated,
    "spatial-tripleplane": _with_angular_textures,
    "zeltner": _with_frames,
    "neumip": _with_offset,
    "ggx-mip": _with_latents,
}
"""By the models' names in bundles."""


def padded(rows: np.ndarray) -> np.ndarray:
    """The last axis filled up with zeros to whole blocks."""
    return np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, -rows.shape[-1] % BLOCK)])


def _layout_macros(place: str, layout: Layout, channels: int) -> dict[str, str]:
    sizes = {"HEIGHT": layout.height, "WIDTH": layout.width, "TOP": layout.top, "CHANNELS": channels}
    numbers = {f"JB_{place}_{name}": str(n) for name, n in (sizes | {"BLOCKS": -(-channels // BLOCK)}).items()}
    return numbers | {f"JB_{place}_WRAP": f"JB_{layout.wrap.upper()}"}


def _with_azimuth(texture: np.ndarray) -> np.ndarray:
    """The texture, with two equal columns where it has one: the kernel reads two."""
    return np.repeat(texture, 2, axis=2) if texture.shape[2] == 1 else texture


def _whole_rows(texture: np.ndarray, columns: int) -> np.ndarray:
    """Matrices `(rows columns, n_r, n_phi)` with every row padded to whole blocks."""
    _, n_r, n_phi = texture.shape
    rows = padded(np.moveaxis(texture.reshape(-1, columns, n_r, n_phi), 1, -1))
    return np.moveaxis(rows, -1, 1).reshape(-1, n_r, n_phi)


def _decoded(frame: Any, warps: Any) -> tuple[Mlp | None, dict[str, str]]:
    """The linear map from latents to the frame's numbers and the warps', and where each begin."""
    weights, biases, places = [], [], {}
    if frame is not None:
        weights.append(np.asarray(frame, np.float64))
        biases.append(np.zeros(NUMBERS))
        places["JB_FRAME"] = "0"
    if warps is not None:
        terms = warps.biases.size // 4
        places |= {"JB_WARPS": str(sum(bias.size for bias in biases)), "JB_WARP_TERMS": str(terms)}
        weights.append(LOG2_E * np.asarray(warps.weights, np.float64))
        # an exponent is a difference from the identity's, whose raw number softplus takes to 1 - LEAST_EXPONENT
        identity = np.repeat([0.0, np.log(np.expm1(1.0 - LEAST_EXPONENT))] * 2, terms)
        biases.append(LOG2_E * (np.asarray(warps.biases, np.float64) + identity))
    if not weights:
        return None, {}
    joined: Any = (np.concatenate(weights, axis=1),), (np.concatenate(biases),)
    return Mlp(*joined), places
