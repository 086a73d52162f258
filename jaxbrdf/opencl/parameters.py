"""A bundle's parameters as kernels read them: sizes and places as macros, numbers as one array."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import expit

from jaxbrdf.export.bundle import Bundle, Precision
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.models.table import ANALYTIC
from jaxbrdf.models.warp import RadialWarp, shares_and_exponents
from jaxbrdf.opencl import analytic, surface
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.opencl.source import check_effects
from jaxbrdf.opencl.surface import LOG2_E, padded
from jaxbrdf.texture.angular import close_centre, is_texture
from jaxbrdf.texture.pyramid import is_pyramid

ALIGNMENT = 16
"""Floats between which texels may begin: a cache line."""

LARGEST = 2**31
"""Elements of all textures together: kernels count them in 32 bits."""

EXP2_RANGE = 125.0
"""Within which kernels take 2^x without clamps: [-126, 127], less what rounding may add."""

SILU_PEAK = 1.8444
"""Where t / (1 + 2^t) is greatest: x = -1.27846 of SiLU, whose least value it is."""

UNREAD_INPUTS = {"nbrdf": 1, "naive-mlp": 4}
"""The network's input that is zero for an isotropic material, y of wh or of wo: its weights are left out."""


class Parameters(NamedTuple):
    """One material's numbers and what they mean.

    Attributes:
        macros: names and values of sizes, of places in the array, and of the effects that there are.
        values: float32: the weights, then from `JB_TEXELS` on the texels, two to a number where they are float16.
    """

    macros: dict[str, str]
    values: np.ndarray


def stored_precision(bundle: Bundle) -> Precision:
    """float16 where that holds every texel exactly, as after a fit that was stored so."""
    return common_precision([bundle])


def common_precision(bundles: Sequence[Bundle]) -> Precision:
    """float16 where that holds every texel of all bundles exactly; float32 too where there is none."""
    textures = [texels for bundle in bundles for texels in _all_texels(_fields(bundle))]
    with np.errstate(over="ignore"):
        exact = all(np.array_equal(texture.astype(np.float16), texture) for texture in textures)
    return "float16" if textures and exact else "float32"


def parameters(bundle: Bundle, shape: Shape, precision: Precision) -> Parameters:
    """The array that kernels of `shape` read, its texels stored in `precision`.

    Raises:
        ValueError: of a part that kernels do not know, of textures that are too large for them, or of texels beyond the
            precision's range.
    """
    macros: dict[str, str] = {"JB_ISOTROPIC": ""} if bundle.manifest.isotropic else {}
    if bundle.manifest.model in ANALYTIC:
        return _of_analytic(bundle, macros)
    fields = _fields(bundle)
    check_effects(bundle.manifest.model, [name for name, value in fields.items() if value is not None])
    inputs = _inputs(fields)
    if bundle.manifest.is_spatial:
        own = surface.prepared(bundle, fields)
        macros, fields, inputs = macros | own.macros, own.fields, None
    weights, texels = _Writer(), _Writer()
    for name, value in fields.items():
        place = f"JB_{name.upper()}"
        if isinstance(value, Mlp):
            scale = LOG2_E if name == "mlp" else 1.0
            mlp = _read_inputs(bundle, value)
            macros |= weights.write(place, *network(mlp, shape, place=place, output_scale=scale, inputs=inputs))
        elif isinstance(value, RadialWarp):
            shares = np.concatenate([np.asarray(part) for part in shares_and_exponents(value)])
            macros |= weights.write(place, {f"{place}_TERMS": str(shares.size // 2)}, shares)
        elif _is_texture(value):
            macros |= texels.write(place, *_texture(place, value))
        elif np.ndim(value) == 2:
            macros |= texels.write(place, {}, value.ravel())
        elif value is not None:
            macros |= weights.write(place, {}, np.reshape(value, 1))
    macros |= _write_scale(bundle, weights)
    values = weights.values()
    macros["JB_WEIGHT_COUNT"] = str(values.size)
    if texels.size == 0:
        return Parameters(macros, values)
    beginning = -(-values.size // ALIGNMENT) * ALIGNMENT
    padding = np.zeros(beginning - values.size, np.float32)
    stored = _narrowed(texels.values(), precision)
    return Parameters(macros | {"JB_TEXELS": str(beginning)}, np.concatenate([values, padding, stored]))


def _of_analytic(bundle: Bundle, macros: dict[str, str]) -> Parameters:
    own, weights = analytic.constants(bundle), _Writer()
    for place, array in own.arrays.items():
        macros |= weights.write(place, {}, array)
    macros |= _write_scale(bundle, weights)
    return Parameters(macros | own.macros | {"JB_WEIGHT_COUNT": str(weights.size)}, weights.values())


class _Writer:
    """Arrays one behind the other, with a macro for the place of each."""

    def __init__(self) -> None:
        self.size = 0
        self._parts: list[np.ndarray] = []

    def write(self, place: str, macros: dict[str, str], part: np.ndarray) -> dict[str, str]:
        beginning, self.size = self.size, self.size + part.size
        self._parts.append(part)
        if self.size >= LARGEST:
            raise ValueError(f"textures of {self.size} numbers are more than kernels can count")
        return {place: str(beginning), **macros}

    def values(self) -> np.ndarray:
        return np.concatenate([np.zeros(0, np.float32), *self._parts], dtype=np.float32)


def _write_scale(bundle: Bundle, weights: _Writer) -> dict[str, str]:
    """The energy scale's place, if there is one."""
    scale = bundle.parts.scale
    return {} if scale is None else weights.write("JB_SCALE", {}, np.ravel(scale.weights))


def _fields(bundle: Bundle) -> dict[str, Any]:
    """The parameters by name, the centres of textures closed: a bundle that was never in a file may have them open."""
    params = bundle.params
    fields: dict[str, Any] = {"mlp": params} if isinstance(params, Mlp) else params._asdict()
    return {name: np.asarray(close_centre(v)) if _is_texture(v) else v for name, v in fields.items()}


def _all_texels(fields: Mapping[str, Any]) -> list[np.ndarray]:
    pyramids = [value.texels for value in fields.values() if is_pyramid(value)]
    return pyramids + [value for value in fields.values() if _is_texture(value)]


def _is_texture(value: Any) -> bool:
    return hasattr(value, "ndim") and is_texture(value)


def _read_inputs(bundle: Bundle, mlp: Mlp) -> Mlp:
    """The network without the input that is zero for this material."""
    model = bundle.manifest.model
    if not (bundle.manifest.isotropic and model in UNREAD_INPUTS):
        return mlp
    first: Any = np.delete(mlp.weights[0], UNREAD_INPUTS[model], axis=0)
    return Mlp((first, *mlp.weights[1:]), mlp.biases)


class Range(NamedTuple):
    """The least and the greatest that each of some numbers can be, `(n,)`."""

    low: np.ndarray
    high: np.ndarray


def network(
    mlp: Mlp,
    shape: Shape,
    *,
    place: str = "JB_MLP",
    activation: str = "silu",
    output_scale: float = 1.0,
    inputs: Range | None = None,
) -> tuple[dict[str, str], np.ndarray]:
    """Macros and numbers of a network: of each tile of a layer its biases, then its weights input by input.

    Args:
        mlp: weights `(n_in, n_out)` and biases.
        shape: of the kernel.
        place: what the macros' names begin with.
        activation: after every layer but the last, `silu` or `relu`.
        output_scale: factor of the outputs.
        inputs: of the first layer, if they are known: SiLU needs no clamps where they cannot leave exp2's range.
    """
    layers, parts = [], []
    hidden_scale = -LOG2_E if activation == "silu" else 1.0
    last, scale = len(mlp.biases) - 1, 1.0
    for i, (weight, bias) in enumerate(zip(mlp.weights, mlp.biases, strict=True)):
        before, scale = scale, output_scale if i == last else hidden_scale
        weight, bias = np.asarray(weight, np.float64) * (scale / before), np.asarray(bias, np.float64) * scale
        tiles = shape.tiles(bias.size)
        sums = _sums(weight, bias, inputs) if inputs and activation == "silu" else None
        is_bounded = sums is not None and sums.low.min() > -EXP2_RANGE and sums.high.max() < EXP2_RANGE
        inputs = _scaled_silu(sums) if sums else None
        name = "linear" if i == last else f"bounded_{activation}" if is_bounded else activation
        layers.append(tiles.layer(weight.shape[0], name))
        for rows in tiles.slices():
            parts += [bias[rows], weight[:, rows].ravel()]
    widest = max(mlp.weights[0].shape[0], *(bias.size for bias in mlp.biases))
    macros = {f"{place}_LAYERS(LAYER)": " ".join(layers), f"{place}_WIDEST": str(widest)}
    return macros, np.concatenate(parts).astype(np.float32)


def _inputs(fields: Mapping[str, Any]) -> Range | None:
    """The network's inputs, where they are interpolated texels, which no query can leave."""
    textures = [leaf for leaf in fields.values() if _is_texture(leaf)]
    if not textures:
        return None
    low, high = (np.concatenate([getattr(t, name)((1, 2)) for t in textures]) for name in ("min", "max"))
    return Range(low, high)


def _sums(weight: np.ndarray, bias: np.ndarray, inputs: Range) -> Range:
    """A layer's outputs before the activation, by interval arithmetic."""
    rising, falling = np.maximum(weight, 0.0), np.minimum(weight, 0.0)
    low = inputs.low @ rising + inputs.high @ falling + bias
    return Range(low, inputs.high @ rising + inputs.low @ falling + bias)


def _scaled_silu(t: Range) -> Range:
    """t / (1 + 2^t): it rises to its greatest value, and falls towards zero beyond."""
    ends = [x * expit(-x / LOG2_E) for x in t]
    has_peak = (t.low < SILU_PEAK) & (t.high > SILU_PEAK)
    peak = SILU_PEAK * expit(-SILU_PEAK / LOG2_E)
    return Range(np.minimum(*ends), np.where(has_peak, peak, np.maximum(*ends)))


def _texture(place: str, texture: np.ndarray) -> tuple[dict[str, str], np.ndarray]:
    """Texels (n_r, n_phi + 1, channels), the first column again after the last; without azimuth (n_r, channels)."""
    channels, n_r, n_phi = texture.shape
    macros = {f"{place}_CHANNELS": channels, f"{place}_RADII": n_r, f"{place}_AZIMUTHS": n_phi}
    texels = np.moveaxis(texture, 0, -1)
    if n_phi > 1:
        texels = np.concatenate([texels, texels[:, :1]], axis=1)
    return {name: str(value) for name, value in macros.items()}, padded(texels).ravel()


def _narrowed(texels: np.ndarray, precision: Precision) -> np.ndarray:
    """The texels in `precision`, as an array of float32 that a kernel reads as it is told to."""
    if precision == "float32":
        return texels
    largest = float(np.abs(texels).max(initial=0.0))
    if largest > float(np.finfo(np.float16).max):
        raise ValueError(f"a texel of {largest:.3g} is beyond the range of float16: store it in float32")
    return texels.astype(np.float16).view(np.float32)
