"""A fitted material as one file: a `.safetensors` of weights and textures with a manifest in its metadata.

docs/file-formats.md tells the layout. What is stored is what a kernel evaluates: the centres of textures are closed.
"""

from __future__ import annotations

import json
from os import PathLike
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import safetensors
import safetensors.numpy

from jaxbrdf.core.tree import named_leaves, with_leaves
from jaxbrdf.data import input as data_input
from jaxbrdf.data.output import write_atomically
from jaxbrdf.errors import DataError
from jaxbrdf.export.assembled import BundleParams, assembled
from jaxbrdf.export.manifest import Manifest, build_brdf, from_json, to_json
from jaxbrdf.export.parts import FORMS, Parts, part_arrays, parts_of
from jaxbrdf.models.table import first_params
from jaxbrdf.texture.angular import close_centre, is_texture
from jaxbrdf.texture.pyramid import is_pyramid
from jaxbrdf.types import Material, Params

METADATA_KEY = "jaxbrdf"
Precision = Literal["float16", "float32"]
"""Of stored texels."""

DTYPES = {"F16": np.dtype("<f2"), "F32": np.dtype("<f4")}


class Bundle(NamedTuple):
    """A manifest, the parameters of its model, and what there is beside them; arrays in float32."""

    manifest: Manifest
    params: Params
    parts: Parts = Parts()


def to_bytes(bundle: Bundle, *, precision: Precision = "float32") -> bytes:
    """The file's content, its textures stored in `precision`.

    Weights stay in float32: they are few, and rounding them costs more than rounding all texels.

    Raises:
        ValueError: naming an array that does not belong to the model, is not finite or exceeds the precision's range.
    """
    arrays, textures = named_leaves(_closed(bundle.params)), _textures(bundle.params)
    shapes = _shapes(named_leaves(_template(bundle.manifest)))
    if _shapes(arrays) != shapes:
        raise ValueError(f"params are {_shapes(arrays)}, the config of {bundle.manifest.model} wants {shapes}")
    narrow, full = np.dtype(precision), np.dtype("float32")
    stored = {name: _narrow(name, array, narrow if name in textures else full) for name, array in arrays.items()}
    stored |= part_arrays(bundle.parts)
    return safetensors.numpy.save(stored, metadata={METADATA_KEY: to_json(bundle.manifest)})


def from_bytes(content: bytes, path: str | PathLike[str]) -> Bundle:
    """The bundle in a file's content; inverse of `to_bytes`, of which it gives the rounded values.

    Raises:
        DataError: naming `path` and the first thing that is wrong.
    """
    try:
        tensors = dict(safetensors.deserialize(content))
        manifest = from_json(_metadata(content))
        parts = {form.tensor: tensors.pop(form.tensor) for form in FORMS.values() if form.tensor in tensors}
        arrays = {name: _array(name, tuple(tensor["shape"]), tensor) for name, tensor in parts.items()}
        return Bundle(manifest, _params(manifest, tensors), parts_of(arrays))
    except safetensors.SafetensorError as error:
        raise DataError(path, f"not a safetensors file: {_one_line(error)}") from None
    except ValueError as error:
        raise DataError(path, _one_line(error)) from None


def save(path: str | PathLike[str], bundle: Bundle, *, precision: Precision = "float32") -> None:
    """Writes the bundle; the path holds a whole file or is untouched.

    Raises:
        DataError: if it cannot be written.
        ValueError: as `to_bytes`.
    """
    write_atomically(path, to_bytes(bundle, precision=precision))


def load(path: str | PathLike[str]) -> Bundle:
    """The bundle in a file.

    Raises:
        DataError: if it cannot be read or is not a sound bundle.
    """
    return from_bytes(data_input.read(path), path)


def material(bundle: Bundle) -> Material:
    """The bundle as a material that JAX evaluates."""
    manifest = bundle.manifest
    params = jax.tree.map(jnp.asarray, BundleParams(bundle.params, bundle.parts))
    return Material(manifest.name, assembled(build_brdf(manifest), bundle.parts), params, manifest.isotropic)


def _closed(params: Params) -> Params:
    return jax.tree.map(lambda leaf: np.asarray(close_centre(leaf) if is_texture(leaf) else leaf), params)


def _textures(params: Params) -> set[str]:
    """Names of the arrays of texels."""
    nodes = named_leaves(params, is_leaf=is_pyramid)
    flat = {name for name, node in nodes.items() if not is_pyramid(node) and is_texture(node)}
    return flat | {f"{name}.texels" for name, node in nodes.items() if is_pyramid(node)}


def _template(manifest: Manifest) -> Params:
    """The shapes of the model's parameters; nothing is allocated."""
    return jax.eval_shape(lambda: first_params(jax.random.key(0), manifest.model, manifest.config))


def _shapes(arrays: dict[str, Any]) -> dict[str, tuple[int, ...]]:
    return {name: array.shape for name, array in arrays.items()}


def _narrow(name: str, array: np.ndarray, dtype: np.dtype) -> np.ndarray:
    if not np.isfinite(array).all():
        raise ValueError(f"{name} is not finite")
    largest = float(np.abs(array).max(initial=0.0))
    if largest > float(np.finfo(dtype).max):
        raise ValueError(f"{name} holds {largest:.3g}, beyond the range of {dtype}: store it in float32")
    return np.array(array, dtype, order="C")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _metadata(content: bytes) -> str:
    """The manifest's text; `content` has passed `safetensors.deserialize`, so its header is sound."""
    length = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + length])
    text = (header.get("__metadata__") or {}).get(METADATA_KEY)
    if text is None:
        raise ValueError("a safetensors file without a jaxbrdf manifest")
    return text


def _params(manifest: Manifest, tensors: dict[str, dict[str, Any]]) -> Params:
    template = _template(manifest)
    shapes = _shapes(named_leaves(template))
    for name in sorted(tensors.keys() - shapes.keys()):
        raise ValueError(f"tensor {name!r:.40} does not belong to model {manifest.model}")
    return with_leaves(template, {name: _array(name, shape, tensors.get(name)) for name, shape in shapes.items()})


def _array(name: str, shape: tuple[int, ...], tensor: dict[str, Any] | None) -> np.ndarray:
    if tensor is None:
        raise ValueError(f"tensor {name} is missing")
    if tensor["dtype"] not in DTYPES:
        raise ValueError(f"tensor {name} is {tensor['dtype']}, not F16 or F32")
    if tuple(tensor["shape"]) != shape:
        raise ValueError(f"tensor {name} is {tuple(tensor['shape'])}, its config says {shape}")
    if 0 in shape or (len(shape) == 3 and shape[1] < 2):
        raise ValueError(f"tensor {name} of shape {shape} is too small to evaluate")
    array = np.frombuffer(tensor["data"], DTYPES[tensor["dtype"]]).astype(np.float32).reshape(shape)
    if not np.isfinite(array).all():
        raise ValueError(f"tensor {name} is not finite")
    return array
