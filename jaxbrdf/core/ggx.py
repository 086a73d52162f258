"""The GGX distribution of microfacet normals: slopes of density 1 / (pi det A (1 + |A^-1 (s - mu)|^2)^2).

(Trowbridge and Reitz 1975; Walter et al. 2007; in tensor form Gauthier et al. 2022, appendix A.1.)
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.microsurface import standard_normal, standard_view, surface_normal
from jaxbrdf.core.numerics import safe_divide, safe_normalize, safe_sqrt, sum_of_squares
from jaxbrdf.core.ranges import Range
from jaxbrdf.core.roughness import Roughness

SLOPE = Range(-100.0, 100.0)
"""Of a mean slope's entries; 100 is a facet that stands within 0.6 degrees of upright."""


class Ggx(NamedTuple):
    """roughness: a record of `jaxbrdf.core.roughness`. slope: mean slope `(2,)` or `(..., 2)`; None if centred."""

    roughness: Roughness
    slope: Annotated[jax.Array, SLOPE] | None = None

    def density(self, wh: jax.Array) -> jax.Array:
        """D(wh) = 1 / (pi det A |M^-1 wh|^4) [1/sr] (Heitz 2014, Eq. 85), zero below the horizon.

        It integrates to one against the cosine of wh.
        """
        spread = sum_of_squares(standard_normal(*self, wh))
        density = 1.0 / (jnp.pi * self.roughness.determinant() * spread * spread)
        return jnp.where(wh[..., 2] > 0, density, 0.0)

    def projected_area(self, w: jax.Array) -> jax.Array:
        """Area of the facets that w sees per area of the surface, (|M^T w| + (M^T w)_z) / 2 (Dupuy 2015).

        In the conjugate form where the standard surface is seen from behind, and the two would cancel.
        """
        x, y, z = jnp.moveaxis(standard_view(*self, w), -1, 0)
        flat = x * x + y * y
        length = safe_sqrt(flat + z * z)
        front = 0.5 * (length + jnp.maximum(z, 0.0))
        return front if self.slope is None else jnp.where(z > 0, front, safe_divide(0.5 * flat, length - z))

    def sample_visible(self, wo: jax.Array, u: jax.Array) -> jax.Array:
        """A normal of density <wo, wh> D(wh) / projected area (Dupuy and Benyoub 2023, spherical caps).

        A standard surface is a hemisphere of mirrors: light from one direction reflects uniformly into a cap of the
        sphere, and a point of that cap gives back the half vector.

        Args:
            wo: `(..., 3)`, above the horizon.
            u: uniform in [0, 1), `(..., 2)`.
        """
        view = safe_normalize(standard_view(*self, wo))
        x, y, z = view[..., 0], view[..., 1], view[..., 2]
        # height of the cap, which leaves no digits in 1 + z where the surface is seen from behind
        height = jnp.where(z > 0, 1.0 + z, (x * x + y * y) / (1.0 - jnp.minimum(z, 0.0)))
        drop = u[..., 1] * height
        sin = safe_sqrt(drop * (2.0 - drop))
        phi = 2.0 * jnp.pi * u[..., 0]
        # the cap's point plus the view
        sum_ = jnp.stack([sin * jnp.cos(phi) + x, sin * jnp.sin(phi) + y, (1.0 - u[..., 1]) * height], axis=-1)
        return surface_normal(*self, sum_)
