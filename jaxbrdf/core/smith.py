"""Smith's masking and shadowing for any distribution of normals, by the projected areas of its facets.

The share of the facets facing w that w sees is G1(w) = cos / area(w) (Heitz 2014, Eq. 31), and what a microfacet lobe
needs of masking, G2 / (4 cos_i cos_o), is then free of divisions by a cosine. Facets that lean away from w on average
(a mean slope) can show it less area than the flat surface; no height field does that, and the area is then taken as
the cosine: light passes between such facets, and nothing is gained.
"""

from __future__ import annotations

from typing import Protocol

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_divide


class Distribution(Protocol):
    """Microfacet normals, as a lobe needs them."""

    def density(self, wh: jax.Array) -> jax.Array:
        """D(wh) [1/sr], `(...)`, which integrates to one against the cosine of wh."""
        ...

    def projected_area(self, w: jax.Array) -> jax.Array:
        """Integral of max(w . wh, 0) D(wh) over wh, `(...)`."""
        ...

    def sample_visible(self, wo: jax.Array, u: jax.Array) -> jax.Array:
        """A normal `(..., 3)` of density max(wo . wh, 0) D(wh) / projected_area(wo), from u `(..., 2)`."""
        ...


LEAST_COSINE = 2.0**-24
"""A rounded float32 unit vector's angle is uncertain by that much. The same in every precision, so that they answer one
question; from there on microfacet lobes (at most 1 / (4 pi a^3 2^-24), 1e18 at a = 1e-4) and their gradients (another
1 / (a 2^-24)) stay far from float32's overflow."""


def lift(w: jax.Array) -> jax.Array:
    """w with its cosine raised to at least `LEAST_COSINE`."""
    z = jnp.maximum(w[..., 2], LEAST_COSINE)
    return jnp.concatenate([w[..., :2], z[..., None]], axis=-1)


def masked_area(distribution: Distribution, w: jax.Array) -> jax.Array:
    """cos / G1(w): the projected area, at least the cosine."""
    return jnp.maximum(distribution.projected_area(w), w[..., 2])


def correlated_visibility(distribution: Distribution, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """G2 / (4 cos_i cos_o) with masking and shadowing correlated by height, G2 = 1 / (1 + Lambda_i + Lambda_o).

    (Heitz 2014, Eq. 99, with 1 + Lambda = area / cos.)
    """
    area_i, area_o = masked_area(distribution, wi), masked_area(distribution, wo)
    across = area_i * wo[..., 2] + (area_o - wo[..., 2]) * wi[..., 2]
    return safe_divide(jnp.full_like(across, 0.25), across)


def separable_visibility(distribution: Distribution, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """G2 / (4 cos_i cos_o) with masking and shadowing independent, G2 = G1(wi) G1(wo) (Heitz 2014, Eq. 98)."""
    across = masked_area(distribution, wi) * masked_area(distribution, wo)
    return safe_divide(jnp.full_like(across, 0.25), across)


def reflected_density(distribution: Distribution, wh: jax.Array, wo: jax.Array) -> jax.Array:
    """Density of wo mirrored about a visible normal wh, D / (4 area(wo)) [1/sr] (Heitz 2018, Eq. 17)."""
    return safe_divide(0.25 * distribution.density(wh), distribution.projected_area(wo))
