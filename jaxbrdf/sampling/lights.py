"""Directions to the light over which the scattered light of one view is summed, whatever the material.

Half of them are cosine-distributed; half are mirrored about half vectors that crowd about the normal on every scale
(`jaxbrdf.sampling.pairs`), so that a lobe of any width meets many of them. Even points of the square, the same for
every view.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import half_vector, reflect
from jaxbrdf.core.numerics import safe_divide, safe_norm
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine
from jaxbrdf.sampling.pairs import half_vector_density, square_to_half_vector
from jaxbrdf.sampling.sobol import sobol_points


def lights_of_view(wo: jax.Array, count: int) -> tuple[jax.Array, jax.Array]:
    """Directions `(count, 3)` to the light for a viewer `(3,)`, and their density [1/sr], `(count,)`.

    Some of the mirrored ones lie below the horizon, where nothing is lit.
    """
    u = jnp.asarray(sobol_points(count // 2, 2) + 0.5 / count)
    wi = jnp.concatenate([square_to_cosine(u), reflect(wo[None], square_to_half_vector(u))])
    both = wi + wo[None]
    mirrored = safe_divide(half_vector_density(half_vector(wi, wo[None])), 2.0 * safe_norm(both))
    return wi, 0.5 * cosine_density(wi) + 0.5 * mirrored
