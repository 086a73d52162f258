"""Directions to the light over which the scattered light of one view is summed, whatever the material.

Half of them are cosine-distributed; half are mirrored about half vectors that crowd about the normal on every scale
(`jaxbrdf.sampling.pairs`), so that a lobe of any width meets many of them. Even points of the square, the same for
every view.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import half_vector, reflect
from jaxbrdf.core.grazing import view_at
from jaxbrdf.core.numerics import safe_divide, safe_norm
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine
from jaxbrdf.sampling.pairs import half_vector_density, square_to_half_vector
from jaxbrdf.sampling.sobol import sobol_points


def lights_of_view(wo: jax.Array, count: int) -> tuple[jax.Array, jax.Array]:
    """Directions `(count, 3)` to the light for a viewer `(3,)`, and their density [1/sr], `(count,)`.

    Some of the mirrored ones lie below the horizon, where nothing is lit.
    """
    u = _points(count // 2)
    wi = jnp.concatenate([square_to_cosine(u), reflect(wo[None], square_to_half_vector(u))])
    return wi, _density(wi, wo)


def lights_to_horizon(wo: jax.Array, count: int) -> tuple[jax.Array, jax.Array]:
    """As `lights_of_view`, of which half are even in the light's elevation by `jaxbrdf.core.grazing`.

    Where f grows like a power of the cosine each decade of it may weigh as much as the next, down to where cosines end.
    """
    u = _points(count // 2)
    wi = jnp.concatenate([lights_of_view(wo, count // 2)[0], view_at(u[:, 0], 2.0 * jnp.pi * u[:, 1])])
    # of cos = (1 - t)^4, d cos / dt = 4 cos^(3/4)
    cos = jnp.maximum(wi[:, 2], jnp.finfo(wi.dtype).tiny)
    even = jnp.where(wi[:, 2] > 0, 1.0 / (8.0 * jnp.pi * cos**0.75), 0.0)
    return wi, 0.5 * _density(wi, wo) + 0.5 * even


def _points(count: int) -> jax.Array:
    return jnp.asarray(sobol_points(count, 2) + 0.25 / count)


def _density(wi: jax.Array, wo: jax.Array) -> jax.Array:
    """Of `lights_of_view` at directions `(n, 3)`."""
    both = wi + wo[None]
    mirrored = safe_divide(half_vector_density(half_vector(wi, wo[None])), 2.0 * safe_norm(both))
    return 0.5 * cosine_density(wi) + 0.5 * mirrored
