"""A bundle's parameters as a kernel takes them: sizes as compile-time constants, numbers as flat buffers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from jaxbrdf.export.bundle import Bundle
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.models.warp import RadialWarp, shares_and_exponents
from jaxbrdf.texture.angular import is_texture


class Argument(NamedTuple):
    """One parameter of a kernel.

    Attributes:
        constants: macros and their values.
        values: flat float32.
        is_weight: whether every work item reads all of it, so that it belongs in constant memory.
    """

    constants: dict[str, str]
    values: np.ndarray
    is_weight: bool


def arguments(bundle: Bundle) -> list[Argument]:
    """The kernel's parameters after `count, wi, wo, f`: one for each field of the model's params, in their order.

    A field that is None is an effect that is not there, and no parameter.
    """
    params = bundle.params
    fields = {"mlp": params} if isinstance(params, Mlp) else params._asdict()
    return [_argument(name.upper(), value) for name, value in fields.items() if value is not None]


def _argument(name: str, value: Any) -> Argument:
    if isinstance(value, Mlp):
        return _mlp(name, value)
    if isinstance(value, RadialWarp):
        return _warp(name, value)
    return _texture(name, value) if is_texture(value) else _scalar(name, value)


def _mlp(name: str, mlp: Mlp) -> Argument:
    """Weights (n_in, n_out) and biases, layer after layer."""
    widths = [mlp.weights[0].shape[0], *(bias.shape[0] for bias in mlp.biases)]
    parts = [np.ravel(part) for layer in zip(mlp.weights, mlp.biases, strict=True) for part in layer]
    constants = {"LAYERS": len(mlp.biases), "WIDTHS": ",".join(map(str, widths)), "WIDEST": max(widths)}
    return Argument(_prefixed(name, constants), np.concatenate(parts), True)


def _warp(name: str, warp: RadialWarp) -> Argument:
    """Shares w_k, then exponents alpha_k."""
    parts = [np.asarray(part) for part in shares_and_exponents(warp)]
    return Argument(_prefixed(name, {"TERMS": parts[0].size}), np.concatenate(parts), True)


def _texture(name: str, texture: np.ndarray) -> Argument:
    """Texels (n_r, n_phi, channels): a lookup reads all channels of a texel."""
    channels, n_r, n_phi = texture.shape
    constants = {"CHANNELS": channels, "RADII": n_r, "AZIMUTHS": n_phi}
    return Argument(_prefixed(name, constants), np.moveaxis(texture, 0, -1).ravel(), False)


def _scalar(name: str, value: np.ndarray) -> Argument:
    """A number whose name, as a macro, says that the effect is there."""
    return Argument({name: ""}, np.reshape(value, 1), True)


def _prefixed(name: str, constants: dict[str, Any]) -> dict[str, str]:
    return {f"{name}_{key}": str(value) for key, value in constants.items()}
