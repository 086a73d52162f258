"""The principled BRDF (Burley 2012, 2015) as it is fitted, with the effects that are asked for. Reciprocal.

f and sampler are those of `jaxbrdf.brdf.principled`. An anisotropic one has its axes along tangent and bitangent, and
can stretch along the tangent alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax

from jaxbrdf.brdf.principled import PRINCIPLED, PrincipledParams
from jaxbrdf.types import Brdf


@dataclass(frozen=True)
class PrincipledConfig:
    """Which effects there are besides a diffuse body under a glossy surface; what is not there is not computed.

    By default those that fits of measured materials gain from: over the twelve RGL files tint and flatness take less
    than 1 % off the squared error.

    Attributes:
        isotropic: whether facets have one roughness.
        metallic: a share of metal.
        spec_tint: reflections of the base's hue.
        sheen: light off grazing fibres, and how far it takes the base's hue.
        flatness: light scattered beneath the surface.
        clearcoat: a second lobe, and its gloss.
    """

    isotropic: bool = True
    metallic: bool = True
    spec_tint: bool = False
    sheen: bool = True
    flatness: bool = False
    clearcoat: bool = True


def principled(config: PrincipledConfig) -> Brdf:
    """The model as a BRDF of `PrincipledParams`, whose own fields say what it has."""
    del config
    return PRINCIPLED


def start_principled(key: jax.Array, config: PrincipledConfig) -> PrincipledParams:
    """Random parameters, roughness from 0.05 on, the index even in its logarithm from 1.1 to 3."""
    u = jax.random.uniform(key, (13,))

    def share(is_there: bool, of: jax.Array) -> jax.Array | None:
        return of if is_there else None

    return PrincipledParams(
        base_color=u[:3],
        roughness=0.05 + 0.95 * u[3],
        eta=1.1 * (3.0 / 1.1) ** u[4],
        metallic=share(config.metallic, u[5]),
        anisotropic=share(not config.isotropic, u[6]),
        spec_tint=share(config.spec_tint, u[7]),
        sheen=share(config.sheen, u[8]),
        sheen_tint=share(config.sheen, u[9]),
        flatness=share(config.flatness, u[10]),
        clearcoat=share(config.clearcoat, u[11]),
        clearcoat_gloss=share(config.clearcoat, u[12]),
    )
