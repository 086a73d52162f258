"""Several materials in one program: entry points side by side, and one that chooses by index."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import NamedTuple

import numpy as np

from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.opencl.parameters import ALIGNMENT, Parameters, common_precision, parameters
from jaxbrdf.opencl.shape import INLINE
from jaxbrdf.opencl.source import entry_points, settings

ARGUMENTS = "const float3 wi, const float3 wo, __global const float *parameters"


class Collection(NamedTuple):
    """The text and the numbers of several materials; what is compiled once serves all that differ in numbers alone.

    Attributes:
        source: OpenCL C, self-contained: `float3 {prefix}_eval(uint index, float3 wi, float3 wo, __global const float
            *parameters)`, and `{prefix}_0_eval(wi, wo, parameters)`, `{prefix}_1_eval`, ... of each.
        parameters: float32, what all of them read: put it into a buffer.
    """

    source: str
    parameters: np.ndarray

    @classmethod
    def load(
        cls, materials: Sequence[Bundle | str | PathLike[str]], *, prefix: str = "material", unroll: bool = False
    ) -> Collection:
        """The materials in the order of their indices.

        Args:
            materials: bundles, or the paths of their files.
            prefix: of the names.
            unroll: as a GPU wants it.

        Raises:
            DataError: if a file is not a sound bundle.
            ValueError: if there is none, one varies over a surface, or the prefix is not an identifier.
        """
        if not materials or not prefix.isidentifier():
            raise ValueError(f"{len(materials)} materials named {prefix!r}: one at least, and an identifier")
        loaded = [m if isinstance(m, Bundle) else bundles.load(m) for m in materials]
        for index, bundle in enumerate(loaded):
            if bundle.manifest.is_spatial:
                raise ValueError(f"material {index} varies over a surface, which a collection does not choose among")
        precision = common_precision(loaded)
        packed = [parameters(bundle, INLINE, precision) for bundle in loaded]
        offsets, values = _joined([p.values for p in packed])
        codes, kinds = _codes(loaded, packed, prefix)
        text = settings(INLINE, precision, unroll=unroll) + "".join(codes) + _entries(prefix, kinds, offsets)
        return cls(text, values)


def _joined(parts: list[np.ndarray]) -> tuple[list[int], np.ndarray]:
    """All numbers one behind the other, each material's at the beginning of a cache line, and where they begin."""
    padded = [np.pad(part, (0, -part.size % ALIGNMENT)) for part in parts]
    return [0, *np.cumsum([part.size for part in padded])[:-1].tolist()], np.concatenate(padded)


def _codes(loaded: list[Bundle], packed: list[Parameters], prefix: str) -> tuple[list[str], list[int]]:
    """The different functions there are, and which of them each material calls."""
    names: dict[str, int] = {}
    texts, kinds = [], []
    for bundle, numbers in zip(loaded, packed, strict=True):
        same = repr((bundle.manifest.model, numbers.macros))
        if same not in names:
            names[same] = len(names)
            points = entry_points(bundle.manifest.model, "inline", numbers.macros, prefix=f"{prefix}_code_{len(texts)}")
            texts.append(points)
        kinds.append(names[same])
    return texts, kinds


def _entries(prefix: str, kinds: list[int], offsets: list[int]) -> str:
    """A function for each material, and the one that chooses among them."""
    lines = [
        f"float3 {prefix}_{i}_eval({ARGUMENTS}) {{ return {prefix}_code_{kind}_eval(wi, wo, parameters + {offset}); }}"
        for i, (kind, offset) in enumerate(zip(kinds, offsets, strict=True))
    ]
    lines.append(f"__constant uint {prefix}_offsets[] = {{{', '.join(map(str, offsets))}}};")
    lines.append(f"__constant uint {prefix}_kinds[] = {{{', '.join(map(str, kinds))}}};")
    lines.append(f"float3 {prefix}_eval(const uint index, {ARGUMENTS}) {{")
    lines.append(f"    __global const float *own = parameters + {prefix}_offsets[index];")
    lines.append(f"    switch ({prefix}_kinds[index]) {{")
    lines += [f"    case {k}: return {prefix}_code_{k}_eval(wi, wo, own);" for k in range(1, max(kinds) + 1)]
    lines += [f"    default: return {prefix}_code_0_eval(wi, wo, own);", "    }", "}"]
    return "\n".join(lines) + "\n"
