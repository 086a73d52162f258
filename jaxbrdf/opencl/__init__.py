"""Bundles on OpenCL devices: `Material` for one, `Sampler` for its light, `Collection` for several in one program."""

from jaxbrdf.opencl.collection import Collection
from jaxbrdf.opencl.material import Material
from jaxbrdf.opencl.sampler import Sampler

__all__ = ["Collection", "Material", "Sampler"]
