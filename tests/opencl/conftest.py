"""Every OpenCL device that is there, each with its context."""

from __future__ import annotations

import os
from typing import NamedTuple

import pyopencl as cl
import pytest

from jaxbrdf.opencl import platform

DEVICES = platform.devices()


class Device(NamedTuple):
    """A device in use."""

    device: cl.Device
    context: cl.Context
    queue: cl.CommandQueue


@pytest.fixture(scope="session", params=DEVICES, ids=platform.describe)
def opencl(request: pytest.FixtureRequest) -> Device:
    """Each device in turn."""
    context = platform.context_of(request.param)
    return Device(request.param, context, cl.CommandQueue(context))


@pytest.fixture(scope="session", autouse=True)
def _both_pocls_in_ci() -> None:
    if os.environ.get("CI") and len({platform.worth(device).pocl_version for device in DEVICES} - {()}) < 2:
        pytest.fail("only one PoCL is there: CI wants PyPI's and Debian's (apt-get install pocl-opencl-icd)")
