"""The published Neural-BRDF networks (Sztrajman et al. 2021) as a material to compare with.

Not the baseline of the same name in Timonen et al., which is `jaxbrdf.models.nbrdf`. The network takes half and
difference vector with phi_h = 0, (h, d), and returns log(1 + f), without a cosine: f = max(exp(x) - 1, 0).
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.cosine_sampler import cosine_sampled
from jaxbrdf.core.directions import above_horizon, half_difference, sin_theta
from jaxbrdf.data.published_nbrdf import Layer
from jaxbrdf.types import Material, Query


def material(layers: tuple[Layer, ...], name: str) -> Material:
    """A file's layers as a material, drawn from by cosine."""
    return Material(name, BRDF, jax.tree.map(jnp.asarray, layers), True)


def evaluate(layers: tuple[Layer, ...], query: Query) -> jax.Array:
    """f(wi, wo), `(..., 3)` in 1/sr; zero below the horizon."""
    half, difference = half_difference(query.wi, query.wo)
    turned = jnp.stack([sin_theta(half), jnp.zeros_like(half[..., 0]), half[..., 2]], axis=-1)
    x = jnp.concatenate([turned, difference], axis=-1)
    for layer in layers[:-1]:
        x = jax.nn.relu(_dense(layer, x))
    f = jnp.maximum(jnp.expm1(_dense(layers[-1], x)), 0.0)
    return jnp.where(above_horizon(query.wi, query.wo)[..., None], f, 0.0)


def _dense(layer: Layer, x: jax.Array) -> jax.Array:
    bias = jnp.expand_dims(layer.bias, tuple(range(x.ndim - 1)))
    return x @ layer.kernel + bias


BRDF = cosine_sampled(evaluate)
"""The pure functions of every published network."""
