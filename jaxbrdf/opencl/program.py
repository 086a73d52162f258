"""Kernel sources, specialised and compiled."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable

import pyopencl as cl

from jaxbrdf.errors import OpenCLError


def model_source(model: str) -> str:
    """The OpenCL C of a model, by its name in `models.table.MODELS`."""
    return files("kernels_cl").joinpath("models", f"{model.replace('-', '_')}.cl").read_text()


def build(context: cl.Context, source: str, constants: Mapping[str, str]) -> cl.Program:
    """`source` compiled for the context's devices, where it may include any file of kernels_cl/include by its name.

    Args:
        context: made by the caller.
        source: OpenCL C 1.2.
        constants: macros: sizes, and the names of variants, with an empty value.

    Raises:
        OpenCLError: with the first error of the device's compiler.
    """
    macros = [f"-D{name}={value}" for name, value in constants.items()]
    headers = [(file.name, cl.Program(context, file.read_text())) for file in _included_files()]
    program = cl.Program(context, source)
    with warnings.catch_warnings():
        # remarks of the driver, and pyopencl's that its cache cannot serve programs with headers: drivers have theirs
        warnings.simplefilter("ignore")
        try:
            program.compile(["-cl-std=CL1.2", *macros], headers=headers)
            return cl.link_program(context, [program])
        except cl.Error as error:
            fault = _first_fault(program, context) or str(error)
            raise OpenCLError(f"the OpenCL compiler refuses the program: {fault}") from None


def _included_files() -> list[Traversable]:
    """Handed to the compiler as texts: an -I with a space in its path is more than some drivers bear."""
    return [file for file in files("kernels_cl").joinpath("include").iterdir() if file.name.endswith(".cl")]


def _first_fault(program: cl.Program, context: cl.Context) -> str:
    logs = [str(program.get_build_info(device, cl.program_build_info.LOG)) for device in context.devices]
    lines = [line.strip() for log in logs for line in log.splitlines() if line.strip()]
    return next((line for line in lines if "error:" in line), "")
