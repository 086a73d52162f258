"""The analytic model that most renderers have: a diffuse part and one or two GGX lobes of Schlick's reflectance.

f = albedo / pi + sum of D(wh) F(wi . wh) G2(wi, wo) / (4 cos_i cos_o), as in `jaxbrdf.brdf.microfacet`. Reciprocal. It
is fitted by least squares, not trained: the cheap end of what there is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.colour import luminance
from jaxbrdf.core.fresnel import Schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.ranges import SHARE
from jaxbrdf.core.roughness import ROUGHNESS, Isotropic, Turned
from jaxbrdf.sampling.mixture import MixtureParams, mixture
from jaxbrdf.sampling.proposal import COSINE, VISIBLE_NORMALS
from jaxbrdf.types import Brdf, Params, Query

LEAST_CHANCE = 0.1
"""Of a lobe: a draw weighs at most ten times what it would if its lobe were the only one."""


@dataclass(frozen=True)
class GgxConfig:
    """What the model has.

    Attributes:
        isotropic: one roughness; otherwise two, and the angle of their axes.
        lobes: how many.
        diffuse: whether there is a diffuse part.
    """

    isotropic: bool = True
    lobes: int = 1
    diffuse: bool = True


@dataclass(frozen=True)
class TwoGgxConfig(GgxConfig):
    """The same with two lobes, such as a coat's and a base's, or a sharp core in a wide foot."""

    lobes: int = 2


@dataclass(frozen=True)
class BareGgxConfig(GgxConfig):
    """One lobe alone, such as a metal's."""

    diffuse: bool = False


class GgxLobe(NamedTuple):
    """f0: reflectance at normal incidence `(3,)`. roughness: `Isotropic` or `Turned`."""

    f0: Annotated[jax.Array, SHARE]
    roughness: Isotropic | Turned


class GgxLobesParams(NamedTuple):
    """albedo: of the diffuse part, `(3,)`, or None; lobes: the glossy ones."""

    albedo: Annotated[jax.Array, SHARE] | None
    lobes: tuple[GgxLobe, ...]


def ggx_lobes(config: GgxConfig) -> Brdf:
    """The model as a BRDF of `GgxLobesParams`, drawn by its own lobes."""
    parts = ([COSINE] if config.diffuse else []) + [VISIBLE_NORMALS] * config.lobes
    return sampled_by(mixture(*parts), _eval, lambda params: Proposed(params, _proposal(params)))


def start_ggx(key: jax.Array, config: GgxConfig) -> GgxLobesParams:
    """Random parameters over the whole of their ranges, roughness even in its logarithm."""
    keys = jax.random.split(key, 1 + config.lobes)
    albedo = jax.random.uniform(keys[0], (3,)) if config.diffuse else None
    return GgxLobesParams(albedo, tuple(_start_lobe(config, key) for key in keys[1:]))


def _start_lobe(config: GgxConfig, key: jax.Array) -> GgxLobe:
    u = jax.random.uniform(key, (6,))
    alpha = ROUGHNESS.low ** (0.75 * u[:2])
    isotropic, turned = Isotropic(alpha[0]), Turned(alpha[0], alpha[1], jnp.pi * u[2])
    return GgxLobe(u[3:], isotropic if config.isotropic else turned)


def _eval(params: GgxLobesParams, query: Query) -> jax.Array:
    lobes = [MicrofacetParams(Ggx(lobe.roughness), Schlick(lobe.f0)) for lobe in params.lobes]
    parts = [MICROFACET.eval(lobe, query) for lobe in lobes]
    parts += [] if params.albedo is None else [LAMBERT.eval(LambertParams(params.albedo), query)]
    return reduce(jnp.add, parts)


def _proposal(params: GgxLobesParams) -> MixtureParams:
    """Lobes drawn by their brightness at normal incidence."""
    diffuse = [] if params.albedo is None else [params.albedo]
    brightness = jnp.stack([luminance(colour) for colour in (*diffuse, *(lobe.f0 for lobe in params.lobes))])
    chances = LEAST_CHANCE + brightness / jnp.maximum(jnp.sum(brightness), LEAST_CHANCE)
    normals: tuple[Params, ...] = tuple(Ggx(lobe.roughness) for lobe in params.lobes)
    return MixtureParams((*(None for _ in diffuse), *normals), chances)
