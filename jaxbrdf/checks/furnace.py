"""The furnace: how much of a uniform surrounding's light a material returns."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.checks.compiled import draws, values
from jaxbrdf.metrics.estimate import NO_DRAWS, Estimate, add_draws, mean
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Brdf, Params, Query


def directional_albedo(
    key: jax.Array, brdf: Brdf, params: Params, wo: jax.Array, *, samples: int = 100_000
) -> Estimate:
    """Integral of f cos(wi) over wi for one viewer `wo`, `(3,)`: `(3,)`, at most one where energy is conserved.

    By the BRDF's own sampler, or by cosine-distributed directions where it has none.
    """
    viewer = jnp.broadcast_to(wo, (samples, 3))
    u = jax.random.uniform(key, (samples, 3), wo.dtype)
    if brdf.sample is not None and brdf.pdf is not None:
        weight = np.asarray(draws(brdf, params, viewer, u).weight)
    else:
        wi = square_to_cosine(u[..., 1:])
        weight = np.pi * values(brdf, params, Query(wi, viewer))
    return mean(add_draws(NO_DRAWS, weight))
