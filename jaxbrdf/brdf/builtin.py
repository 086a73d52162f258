"""Named materials composed of the analytic lobes, so that everything works without a file.

Metals take their refractive index from `jaxbrdf.brdf.metals`, whose pair for a channel has the spectral reflectance
under D65 as Rec.709 shows it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import jax.numpy as jnp

from jaxbrdf.brdf.composite import CompositeParams, composite
from jaxbrdf.brdf.domain import checked_material
from jaxbrdf.brdf.metals import METALS
from jaxbrdf.brdf.microfacet import MICROFACET, ggx
from jaxbrdf.brdf.substrate import SUBSTRATE, SubstrateParams
from jaxbrdf.core.fresnel import Dielectric
from jaxbrdf.types import Material

_GLAZED = composite(SUBSTRATE, MICROFACET)


def _gold() -> Material:
    """Satin gold, roughness 0.2."""
    params = ggx(jnp.array(0.2), jnp.array(0.2), METALS["gold"]())
    return checked_material("gold", MICROFACET, params, isotropic=True)


def _brushed_aluminium() -> Material:
    """Aluminium brushed along the tangent, so it spreads light across it."""
    params = ggx(jnp.array(0.08), jnp.array(0.35), METALS["aluminium"]())
    return checked_material("brushed-aluminium", MICROFACET, params, isotropic=False)


def _glazed_ceramic() -> Material:
    """A blue-green body under a clear glaze of index 1.5 and roughness 0.05."""
    eta = jnp.array(1.5)
    body = SubstrateParams(jnp.array([0.08, 0.32, 0.38]), eta)
    glaze = ggx(jnp.array(0.05), jnp.array(0.05), Dielectric(eta))
    params = CompositeParams((body, glaze), jnp.array([0.6, 0.4]))
    return checked_material("glazed-ceramic", _GLAZED, params, isotropic=True)


MATERIALS: Mapping[str, Callable[[], Material]] = MappingProxyType(
    {"gold": _gold, "brushed-aluminium": _brushed_aluminium, "glazed-ceramic": _glazed_ceramic}
)
