"""OpenCL C compiled for a device, and kept on disk."""

from __future__ import annotations

import contextlib
import warnings
from typing import Any

import pyopencl as cl

from jaxbrdf.errors import OpenCLError
from jaxbrdf.opencl import cache
from jaxbrdf.opencl.platform import identity

OPTIONS = ("-cl-std=CL1.2", "-w")


def build(context: cl.Context, source: str) -> cl.Program:
    """`source` compiled for the context's devices: from the cache where the same was compiled before.

    Args:
        context: made by the caller.
        source: OpenCL C 1.2, self-contained.

    Raises:
        OpenCLError: with the first error of the device's compiler.
    """
    devices = context.devices
    if len(devices) > 1:
        return _compile(context, source)
    name = cache.key(source, *OPTIONS, identity(devices[0]))
    program = _from_cache(context, name)
    if program is None:
        program = _compile(context, source)
        binaries: Any = program.get_info(cl.program_info.BINARIES)
        cache.write(name, binaries[0])
    return program


def _from_cache(context: cl.Context, name: str) -> cl.Program | None:
    binary = cache.read(name)
    if binary is None:
        return None
    # a driver may refuse what it wrote itself, as after an update that left its version alone
    with contextlib.suppress(cl.Error), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return cl.Program(context, context.devices, [binary]).build()
    return None


def _compile(context: cl.Context, source: str) -> cl.Program:
    program = cl.Program(context, source)
    # pyopencl's own cache would hold the same a second time
    no_cache: Any = False
    with warnings.catch_warnings():
        # remarks of the driver, which come as warnings
        warnings.simplefilter("ignore")
        try:
            return program.build(list(OPTIONS), cache_dir=no_cache)
        except cl.Error as error:
            fault = _first_fault(error)
            raise OpenCLError(f"the OpenCL compiler refuses the program: {fault}") from None


def _first_fault(error: cl.Error) -> str:
    """The first line of the log that tells an error, else the first line."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return next((line for line in lines if "error:" in line), lines[0])
