"""OpenCL C texts, specialised: nothing but what a material has."""

from __future__ import annotations

import re
from collections.abc import Iterable
from importlib.resources import files

from jaxbrdf.export.bundle import Precision
from jaxbrdf.models.table import kernel_of
from jaxbrdf.opencl.shape import Shape

INCLUDE = re.compile(r'#include "(\w+\.cl)"')


def settings(shape: Shape, precision: Precision, *, weights: str = "__global", unroll: bool = False) -> str:
    """The macros that all materials of a program share.

    Args:
        shape: of its kernels.
        precision: of its texels.
        weights: the address space they are read from; with `__local` each work group copies them first.
        unroll: whether loops over a layer's inputs are unrolled, as a GPU's registers want it.
    """
    bits = {"float16": 16, "float32": 32}[precision]
    macros = {"JB_WIDTH": shape.width, "JB_GROUP": shape.group, "JB_STORED_BITS": bits, "JB_WEIGHTS": weights}
    flags = {"JB_LOCAL_WEIGHTS": weights == "__local", "JB_UNROLL": unroll}
    lines = [
        f"#if defined(JB_STORED_BITS) && (JB_STORED_BITS != {bits} || JB_WIDTH != {shape.width})",
        '#error "materials of one program must have one precision and one width"',
        "#endif",
        *_defines({name: str(value) for name, value in macros.items()}),
        *_defines({name: "" for name, holds in flags.items() if holds}),
    ]
    return _joined(lines)


def helpers(*names: str) -> str:
    """The named files of kernels_cl/include, each after those that it includes."""
    return "".join(_with_includes([f"include/{name}.cl" for name in names]).values())


def entry_points(model: str | None, entry: str, macros: dict[str, str], *, prefix: str) -> str:
    """A material's functions, named `{prefix}_...`, after the helpers that they need.

    Args:
        model: a key of `models.table.MODELS`, or None for a bare network.
        entry: a file of kernels_cl/entry, which calls the model.
        macros: as `parameters.Parameters` has them; they hold for these functions alone.
        prefix: of the names.

    Raises:
        ValueError: if there is no kernel of the model.
    """
    models = [] if model is None else [_model_file(model)]
    own = [*models, f"entry/{entry}.cl"]
    texts = _with_includes(own)
    shared = [text for name, text in texts.items() if name not in own]
    named = {"JB_NAME(x)": f"{prefix}_##x"} | macros
    ending = [f"#undef {name.partition('(')[0]}" for name in named]
    return "".join(shared) + _joined(_defines(named)) + "".join(texts[name] for name in own) + _joined(ending)


def check_effects(model: str, effects: Iterable[str]) -> None:
    """Refuses a material with a part that its kernel would leave out.

    Args:
        model: a key of `models.table.MODELS`.
        effects: names of the material's parts.

    Raises:
        ValueError: naming the part.
    """
    text = files("kernels_cl").joinpath(*_model_file(model).split("/")).read_text()
    for effect in effects:
        if not re.search(rf"\bJB_{effect.upper()}\b", text):
            raise ValueError(f"the kernel of model {model} does not know {effect}")


def _model_file(model: str) -> str:
    name = f"{kernel_of(model)}.cl"
    if not files("kernels_cl").joinpath("models", name).is_file():
        raise ValueError(f"there is no kernel of model {model!r}")
    return f"models/{name}"


def _defines(macros: dict[str, str]) -> list[str]:
    return [f"#define {name} {value}".rstrip() for name, value in macros.items()]


def _joined(lines: list[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _with_includes(names: list[str]) -> dict[str, str]:
    """Files of kernels_cl and those that they include, each after what it includes, less the lines that say so."""
    texts: dict[str, str] = {}
    for name in names:
        lines = files("kernels_cl").joinpath(*name.split("/")).read_text().splitlines()
        included = [f"include/{found[1]}" for line in lines if (found := INCLUDE.match(line))]
        texts |= {n: text for n, text in _with_includes(included).items() if n not in texts}
        texts[name] = _joined([line for line in lines if not INCLUDE.match(line)])
    return texts
