"""Ways to draw a direction to the light, apart from any reflectance.

A proposal may send draws below the horizon, where nothing is lit: they are lost, and its density, which is zero there,
integrates to less than one by as much.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import above_horizon, reflect
from jaxbrdf.core.numerics import safe_normalize
from jaxbrdf.core.smith import Distribution, lift, reflected_density
from jaxbrdf.sampling.hemisphere import cosine_density, square_to_cosine, square_to_uniform, uniform_density
from jaxbrdf.types import Params


class Proposal(NamedTuple):
    """A sampler and its density as pure functions of their parameters.

    Attributes:
        sample: `(params, wo, u) -> wi`, for viewers `(..., 3)` and u uniform in [0, 1), `(..., 3)`: u[0] chooses among
            lobes, u[1] and u[2] a direction.
        pdf: `(params, wi, wo) -> density` of that wi per solid angle, `(...)`; zero where either direction is at or
            below the horizon.
    """

    sample: Callable[[Params, jax.Array, jax.Array], jax.Array]
    pdf: Callable[[Params, jax.Array, jax.Array], jax.Array]


def _sample_cosine(_: None, wo: jax.Array, u: jax.Array) -> jax.Array:
    del wo
    return square_to_cosine(u[..., 1:])


def _cosine_pdf(_: None, wi: jax.Array, wo: jax.Array) -> jax.Array:
    return jnp.where(above_horizon(wi, wo), cosine_density(wi), 0.0)


def _sample_uniform(_: None, wo: jax.Array, u: jax.Array) -> jax.Array:
    del wo
    return square_to_uniform(u[..., 1:])


def _uniform_pdf(_: None, wi: jax.Array, wo: jax.Array) -> jax.Array:
    return jnp.where(above_horizon(wi, wo), uniform_density(wi), 0.0)


def _sample_visible(normals: Distribution, wo: jax.Array, u: jax.Array) -> jax.Array:
    view = lift(wo)
    return reflect(view, normals.sample_visible(view, u[..., 1:]))


def _visible_pdf(normals: Distribution, wi: jax.Array, wo: jax.Array) -> jax.Array:
    light, view = lift(wi), lift(wo)
    density = reflected_density(normals, safe_normalize(light + view), view)
    return jnp.where(above_horizon(wi, wo), density, 0.0)


COSINE = Proposal(_sample_cosine, _cosine_pdf)
"""Density cos(wi) / pi; no parameters (None)."""

UNIFORM = Proposal(_sample_uniform, _uniform_pdf)
"""Density 1 / (2 pi); no parameters (None)."""

VISIBLE_NORMALS = Proposal(_sample_visible, _visible_pdf)
"""The viewer mirrored about the microfacet normals that it sees (Heitz 2018); parameters a `Distribution`, as `Ggx`."""
