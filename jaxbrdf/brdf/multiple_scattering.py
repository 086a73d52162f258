"""What rough microfacets lose by single scattering, given back: a lobe to be added to `MICROFACET` of equal parameters.

    f = F_ms (1 - E(wi)) (1 - E(wo)) / (pi (1 - mean E)),   F_ms = mean F^2 mean E / (1 - mean F (1 - mean E))

with E(w) the directional albedo of the single scattering at a reflectance of one and means weighted by the cosine, over
all directions and, of F, over the cosine itself (Kulla and Conty 2017; F_ms, the series over all further scatterings,
after Hill 2018). Reciprocal; with a reflectance of one the sum returns all light, as far as E is known
(`jaxbrdf.brdf.microfacet_loss`). It has the energy of multiple scattering, not its shape: seen from the side real
facets send more of it forward.

Parameters: as `MICROFACET`'s, without mean slope.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.microfacet import MicrofacetParams
from jaxbrdf.brdf.microfacet_loss import loss, mean_loss
from jaxbrdf.brdf.proposed import Proposed, sampled_by
from jaxbrdf.core.directions import above_horizon, cos_theta
from jaxbrdf.core.fresnel import Fresnel
from jaxbrdf.core.numerics import match_rank
from jaxbrdf.core.smith import lift
from jaxbrdf.sampling.proposal import COSINE
from jaxbrdf.types import Query


def _eval(params: MicrofacetParams, query: Query) -> jax.Array:
    lost = loss(params.distribution, lift(query.wi)) * _albedo_share(params, query)
    f = lost[..., None] * _albedo_again(params, query) / jnp.pi
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _albedo_share(params: MicrofacetParams, query: Query) -> jax.Array:
    """(1 - E(wo)) / (1 - mean E)."""
    return loss(params.distribution, lift(query.wo)) / mean_loss(params.distribution)


def _albedo_again(params: MicrofacetParams, query: Query) -> jax.Array:
    """F_ms, `(..., 3)`."""
    mean = mean_reflectance(params.fresnel, query.wo.ndim - 1)
    lost = match_rank(mean_loss(params.distribution)[..., None], query.wo.ndim)
    return mean * mean * (1.0 - lost) / (1.0 - mean * lost)


def _albedo(params: MicrofacetParams, query: Query) -> jax.Array:
    again = loss(params.distribution, lift(query.wo))[..., None] * _albedo_again(params, query)
    return jnp.where(cos_theta(query.wo)[..., None] > 0, again, 0.0)


def mean_reflectance(fresnel: Fresnel, rank: int, *, nodes: int = 16) -> jax.Array:
    """Integral of 2 cos F(cos) over cos in [0, 1], `(..., 3)`, for parameters of at most `rank` batch axes.

    Gauss-Legendre quadrature in sqrt(cos), where F is smooth at grazing angles: error below 1e-5 for metals and for
    dielectrics of index 1 to 3. Total reflection has a kink, which costs up to 1e-2.
    """
    points, weights = np.polynomial.legendre.leggauss(nodes)
    root = 0.5 * (points + 1.0)
    dtype = jax.tree.leaves(fresnel)[0].dtype
    cosines, masses = jnp.asarray(root**2, dtype), 2.0 * weights * root**3
    reflectances = jax.vmap(lambda cos: fresnel.reflectance(jnp.full((1,) * rank, cos)))(cosines)
    return jnp.tensordot(jnp.asarray(masses, dtype), reflectances, axes=1)


_SAMPLED = sampled_by(COSINE, _eval, lambda params: Proposed(params, None))
MULTIPLE_SCATTERING = within_ranges(_SAMPLED._replace(albedo=_albedo))
