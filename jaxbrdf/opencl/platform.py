"""Which OpenCL device to use: what is there, in order of worth, and a user's own choice."""

from __future__ import annotations

import os
import re
from typing import NamedTuple

import pyopencl as cl

from jaxbrdf.errors import OpenCLError

CHOICE_VARIABLE = "PYOPENCL_CTX"
"""Environment variable of pyopencl that names a device, in the syntax of `choose`."""


class Worth(NamedTuple):
    """What decides between devices, the most important first; the greatest is taken."""

    is_gpu: bool
    is_vendor: bool
    pocl_version: tuple[int, ...]


def devices() -> list[cl.Device]:
    """Every device there is, the best first: GPUs before processors, a vendor's driver before PoCL, new before old.

    Raises:
        OpenCLError: if there is none.
    """
    found = [device for platform in _platforms() for device in _devices(platform)]
    if not found:
        raise OpenCLError("no OpenCL device found: install a driver, or Debian's pocl-opencl-icd for the processor")
    return sorted(found, key=worth, reverse=True)


def choose(*, which: str | None = None) -> cl.Device:
    """The best device, or the best of those that `which` names.

    Args:
        which: `platform` or `platform:device`, each an index into OpenCL's own lists, a part of a name or version, or
            empty for any; as pyopencl understands PYOPENCL_CTX, which is taken when `which` is None.

    Raises:
        OpenCLError: if there is no such device.
    """
    wanted = os.environ.get(CHOICE_VARIABLE, "") if which is None else which
    platform_wanted, _, device_wanted = wanted.partition(":")
    found = devices()
    fitting = [d for d in found if _is_wanted(d, platform_wanted, device_wanted)]
    if not fitting:
        names = "; ".join(describe(device) for device in found)
        raise OpenCLError(f"no OpenCL device is named {wanted!r}; there are: {names}")
    return fitting[0]


def context_of(device: cl.Device) -> cl.Context:
    """A context of the one device.

    Raises:
        OpenCLError: if the device refuses.
    """
    try:
        return cl.Context([device])
    except cl.Error as error:
        raise OpenCLError(f"{describe(device)} cannot be used: {error}") from None


def describe(device: cl.Device) -> str:
    """Device and platform with its version, on one line."""
    # PoCL adds how it was built, after two spaces
    version = device.platform.version.split("  ")[0]
    return f"{device.name} ({device.platform.name}, {version})"


def identity(device: cl.Device) -> str:
    """All that a compiled program or a measurement on the device depends on."""
    platform = device.platform
    parts = platform.name, platform.version, device.name, device.vendor, device.version, device.driver_version
    return "; ".join(parts)


def is_gpu(device: cl.Device) -> bool:
    """Whether work items run in lockstep and share their registers, as on a GPU."""
    return bool(device.type & cl.device_type.GPU)


def worth(device: cl.Device) -> Worth:
    """The device's rank among others."""
    pocl = re.search(r"PoCL (\d+)\.(\d+)", device.platform.version, re.IGNORECASE)
    version = tuple(map(int, pocl.groups())) if pocl else ()
    return Worth(is_gpu(device), not pocl, version)


def _platforms() -> list[cl.Platform]:
    try:
        return cl.get_platforms()
    except cl.Error as error:
        raise OpenCLError(
            f"no OpenCL platform found ({error}): install a driver, or Debian's pocl-opencl-icd for the processor"
        ) from None


def _devices(platform: cl.Platform) -> list[cl.Device]:
    # a platform without devices says so with an error
    try:
        return platform.get_devices()
    except cl.Error:
        return []


def _is_wanted(device: cl.Device, platform_wanted: str, device_wanted: str) -> bool:
    platform = device.platform
    names = f"{platform.name} {platform.version}", device.name
    places = _platforms().index(platform), _devices(platform).index(device)
    wanted = platform_wanted, device_wanted
    return all(_matches(w, name, place) for w, name, place in zip(wanted, names, places, strict=True))


def _matches(wanted: str, name: str, place: int) -> bool:
    return int(wanted) == place if wanted.isdecimal() else wanted.lower() in name.lower()
