"""Bundles on OpenCL devices: `Material` for one, `Collection` for several in one program."""

from jaxbrdf.opencl.collection import Collection
from jaxbrdf.opencl.material import Material

__all__ = ["Collection", "Material"]
