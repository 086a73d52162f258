from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pyopencl as cl
import pytest

from jaxbrdf.errors import OpenCLError
from jaxbrdf.opencl import platform
from tests.source import ROOT


def device(version: str, kind: int) -> Any:
    return SimpleNamespace(type=kind, platform=SimpleNamespace(version=version))


def test_devices_come_in_the_order_of_their_worth():
    gpu = device("OpenCL 3.0 CUDA 12.2.148", cl.device_type.GPU)
    pocl_gpu = device("OpenCL 3.0 PoCL 6.0", cl.device_type.GPU)
    intel = device("OpenCL 3.0 LINUX", cl.device_type.CPU)
    pocls = [
        device(f"OpenCL 3.0 PoCL {v}  Linux", cl.device_type.CPU) for v in ("10.0", "6.0", "3.1+debian", "3.0-rc2")
    ]
    wanted = [gpu, pocl_gpu, intel, *pocls]
    assert sorted(reversed(wanted), key=platform.worth, reverse=True) == wanted


def test_the_best_is_chosen_unless_another_is_named():
    found = platform.devices()
    assert platform.choose(which="") == found[0]
    for place, at in enumerate(cl.get_platforms()):
        for index, one in enumerate(at.get_devices()):
            assert platform.choose(which=f"{place}:{index}") == one
            assert platform.choose(which=f"{at.version.upper()}:{one.name}") == one


def test_the_environment_names_a_device(monkeypatch: pytest.MonkeyPatch):
    last = platform.devices()[-1]
    monkeypatch.setenv("PYOPENCL_CTX", last.platform.version)
    assert platform.choose() == last
    monkeypatch.setenv("PYOPENCL_CTX", "no such thing")
    with pytest.raises(OpenCLError, match="no OpenCL device is named 'no such thing'; there are: "):
        platform.choose()


@pytest.mark.parametrize("which", ["99", "0:99", ":no such device", "no such platform:0"])
def test_a_device_that_is_not_there_is_told_with_those_that_are(which: str):
    with pytest.raises(OpenCLError) as raised:
        platform.choose(which=which)
    assert platform.describe(platform.devices()[0]) in str(raised.value)
    assert "\n" not in str(raised.value)


def test_no_opencl_at_all_is_one_clear_error():
    code = "from jaxbrdf.opencl import platform\nplatform.choose()"
    # the loader looks for drivers where this variable says
    environment = os.environ | {"OCL_ICD_VENDORS": "/nonexistent", "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.stderr.strip().splitlines()[-1].startswith("jaxbrdf.errors.OpenCLError: no OpenCL platform found (")
