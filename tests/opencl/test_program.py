from __future__ import annotations

from importlib.resources import files

import pytest

from jaxbrdf.errors import OpenCLError
from jaxbrdf.models.table import MODELS
from jaxbrdf.opencl.program import build, model_source
from tests.opencl.conftest import Device


def test_every_model_has_a_kernel():
    assert all("__kernel void evaluate(" in model_source(model) for model in MODELS)


@pytest.mark.parametrize(
    ("source", "fault"),
    [
        ("__kernel void f(__global float *a) { a[0] = b; }", "undeclared identifier 'b'"),
        ('#include "nothing.cl"\n', "'nothing.cl' file not found"),
    ],
)
def test_the_compilers_first_error_is_told(opencl: Device, source: str, fault: str):
    with pytest.raises(OpenCLError, match=fault) as raised:
        build(opencl.context, source, {})
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("name", sorted(f.name for f in files("kernels_cl").joinpath("include").iterdir()))
def test_every_helper_compiles_alone_and_twice(opencl: Device, name: str):
    sizes = {"MLP_LAYERS": "1", "MLP_WIDTHS": "3,3", "MLP_WIDEST": "3", "HORIZON": ""}
    build(opencl.context, f'#include "{name}"\n#include "{name}"\n__kernel void nothing(void) {{}}', sizes)
