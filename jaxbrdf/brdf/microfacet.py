"""Rough reflection off microfacets of any distribution and interface.

f = D(wh) F(wi . wh) G2(wi, wo) / (4 cos_i cos_o) (Walter et al. 2007, Eq. 20), visible normals as the sampler. Single
scattering: rough lobes lose energy, which `jaxbrdf.brdf.multiple_scattering` gives back.

Parameters: distribution, a `Ggx` or `Beckmann` record of `jaxbrdf.core`, whose roughness says whether it is isotropic,
along the axes, turned or a tensor, and whose slope, if any, is the mean of its facets'; fresnel, a record of
`jaxbrdf.core.fresnel`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.core.directions import above_horizon, cos_theta, dot, reflect
from jaxbrdf.core.fresnel import Fresnel
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.numerics import safe_norm, safe_normalize
from jaxbrdf.core.roughness import Axes
from jaxbrdf.core.smith import (
    Distribution,
    correlated_visibility,
    lift,
    reflected_density,
    separable_visibility,
)
from jaxbrdf.types import Brdf, Query, Sample

Visibility = Callable[[Distribution, jax.Array, jax.Array], jax.Array]


class MicrofacetParams(NamedTuple):
    """How the facets lie, and the interface that each of them is."""

    distribution: Distribution
    fresnel: Fresnel


def ggx(alpha_x: jax.Array, alpha_y: jax.Array, fresnel: Fresnel) -> MicrofacetParams:
    """GGX facets with their roughness along tangent and bitangent."""
    return MicrofacetParams(Ggx(Axes(alpha_x, alpha_y)), fresnel)


def microfacet(visibility: Visibility) -> Brdf:
    """The lobe with this masking and shadowing; `MICROFACET` is the usual one."""

    def evaluate(params: MicrofacetParams, query: Query) -> jax.Array:
        wi, wo = lift(query.wi), lift(query.wo)
        both = wi + wo
        # wi . wh = |wi + wo| / 2 for unit vectors, and the length does not cancel where the two are opposed
        cos_d = jnp.minimum(0.5 * safe_norm(both), 1.0)
        lobe = params.distribution.density(safe_normalize(both)) * visibility(params.distribution, wi, wo)
        f = lobe[..., None] * params.fresnel.reflectance(cos_d)
        return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)

    def sample(params: MicrofacetParams, query: Query, u: jax.Array) -> Sample:
        wo = lift(query.wo)
        wh = params.distribution.sample_visible(wo, u[..., 1:])
        wi = reflect(wo, wh)
        lit = above_horizon(wi, query.wo)
        density = jnp.where(lit, reflected_density(params.distribution, wh, wo), 0.0)
        cos_d = jnp.clip(dot(wo, wh), 0.0, 1.0)
        # f cos_i / pdf, in which the density of normals is gone
        seen = 4.0 * params.distribution.projected_area(wo) * cos_theta(wi)
        weight = (seen * visibility(params.distribution, lift(wi), wo))[..., None] * params.fresnel.reflectance(cos_d)
        return Sample(wi, density, jnp.where(lit[..., None], weight, 0.0))

    return within_ranges(Brdf(evaluate, sample, _pdf))


def _pdf(params: MicrofacetParams, query: Query) -> jax.Array:
    wi, wo = lift(query.wi), lift(query.wo)
    density = reflected_density(params.distribution, safe_normalize(wi + wo), wo)
    return jnp.where(above_horizon(query.wi, query.wo), density, 0.0)


MICROFACET = microfacet(correlated_visibility)
"""Masking and shadowing correlated by height (Heitz 2014, Eq. 99)."""

SEPARABLE_MICROFACET = microfacet(separable_visibility)
"""Masking and shadowing independent of each other, as many renderers have it; darker at grazing angles."""
