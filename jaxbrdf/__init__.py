"""jaxbrdf: small neural and analytic reflectance, fitted with JAX and evaluated with OpenCL."""

from jaxbrdf.errors import DataError, FitError, JaxbrdfError, OpenCLError
from jaxbrdf.types import Brdf, Material, Model, Query, Sample

__all__ = ["Brdf", "DataError", "FitError", "JaxbrdfError", "Material", "Model", "OpenCLError", "Query", "Sample"]
__version__ = "0.1.0"
