"""What every test runs under, and the real data that some need."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import jax
import mitsuba
import pytest
from hypothesis import settings

# The suite compiles far more than it runs: with these options of XLA, of another code generator, no optimisation by
# LLVM and one module a function, compiling takes a third less than with its first level, and what runs for long takes
# up to twice as long. They come and go between releases, and a wrong one ends the process, so they are set for the
# release that they were measured with. `make check-long` asks the same of what users compile.
XLA_OPTIONS = (
    "--xla_cpu_use_fusion_emitters=false",
    "--xla_backend_optimization_level=0",
    "--xla_cpu_parallel_codegen_split_count=1",
)
if version("jaxlib").startswith("0.10.") and "XLA_FLAGS" not in os.environ:
    os.environ["XLA_FLAGS"] = " ".join(XLA_OPTIONS)

jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_enable_x64", False)
# as the command line has it on two cores; it cannot be changed once JAX has been used
jax.config.update("jax_num_cpu_devices", 2)

# The same examples every time, and no deadline: the first example of a test compiles.
settings.register_profile("jaxbrdf", deadline=None, derandomize=True, max_examples=40)
settings.load_profile("jaxbrdf")


MOST_MAPPINGS = 25_000
"""Of a process's memory: compiled code takes dozens a function, and Linux allows 65,530, past which compiling ends the
process. What one file of tests compiles stays below the other half."""


@pytest.fixture(autouse=True, scope="module")
def few_mappings() -> Iterator[None]:
    """Frees compiled code after a file of tests, where there is much of it."""
    yield
    mappings = Path("/proc/self/maps")
    if mappings.is_file() and mappings.read_bytes().count(b"\n") > MOST_MAPPINGS:
        jax.clear_caches()


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real data, which the project does not carry."""
    folder = os.environ.get("JAXBRDF_DATA")
    if folder:
        return Path(folder)
    reason = "JAXBRDF_DATA names no folder of real data"
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture
def mitsuba_rgb() -> Iterator[ModuleType]:
    """Mitsuba with linear Rec.709 colours, one query at a time."""
    yield from _variant("scalar_rgb")


@pytest.fixture
def mitsuba_spectral() -> Iterator[ModuleType]:
    """Mitsuba with wavelengths, one query at a time."""
    yield from _variant("scalar_spectral")


@pytest.fixture
def mitsuba_arrays() -> Iterator[ModuleType]:
    """Mitsuba on arrays, compiled by LLVM, which must be installed (PoCL's package brings it)."""
    for mi in _variant("llvm_ad_rgb"):
        try:
            mi.Float([1.0, 2.0]) + 1.0
        except RuntimeError as error:
            if os.environ.get("CI"):
                raise
            pytest.skip(f"Mitsuba finds no LLVM: {error}")
        yield mi


def _variant(name: str) -> Iterator[ModuleType]:
    before = mitsuba.variant()
    mitsuba.set_variant(name)
    yield mitsuba
    if before:
        mitsuba.set_variant(before)
