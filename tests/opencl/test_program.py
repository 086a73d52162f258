from __future__ import annotations

from importlib.resources import files

import pytest

from jaxbrdf.errors import OpenCLError
from jaxbrdf.models.table import BUNDLED, kernel_of
from jaxbrdf.opencl.program import build
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.opencl.source import helpers, settings
from tests.opencl.conftest import Device

HELPERS = sorted(f.name.removesuffix(".cl") for f in files("kernels_cl").joinpath("include").iterdir())


def test_every_model_has_a_kernel():
    models = {f.name for f in files("kernels_cl").joinpath("models").iterdir()}
    assert models == {f"{kernel_of(name)}.cl" for name in BUNDLED}


def test_the_compilers_first_error_is_told(opencl: Device):
    source = "__kernel void f(__global float *a) { a[0] = b; }"
    with pytest.raises(OpenCLError, match="undeclared identifier 'b'") as raised:
        build(opencl.context, source)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("name", HELPERS)
def test_every_helper_compiles_alone_and_twice(opencl: Device, name: str):
    text = settings(Shape(8, 8), "float32") + helpers(name)
    build(opencl.context, text + text + "__kernel void nothing(void) {}")
