"""The optimiser as a stateless transformation: Adam on smoothed gradients, a rate for textures and one for the rest."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import optax

from jaxbrdf.texture.angular import is_texture
from jaxbrdf.texture.preconditioner import smooth
from jaxbrdf.types import Params


@dataclass(frozen=True)
class OptimiserConfig:
    """Adam's numbers; the defaults are Timonen et al.'s (section 4.5).

    Attributes:
        texture_rate, network_rate: first learning rates.
        beta1, beta2, epsilon: Adam's.
        smoothing: A of the textures' preconditioner; zero leaves it out.
    """

    texture_rate: float = 3e-3
    network_rate: float = 3e-3
    beta1: float = 0.99
    beta2: float = 0.999
    epsilon: float = 1e-15
    smoothing: float = 5.0


def adam(config: OptimiserConfig) -> optax.GradientTransformation:
    """Preconditioned Adam whose updates still wait for the schedule's factor."""
    smoothing = [optax.stateless(_smoother(config.smoothing))] if config.smoothing else []
    scaling = optax.scale_by_adam(config.beta1, config.beta2, config.epsilon)
    return optax.chain(*smoothing, scaling, *smoothing, optax.stateless(_rates(config)))


def _smoother(strength: float):
    def update(updates: Params, params: Params | None) -> Params:
        del params
        return jax.tree.map(lambda leaf: smooth(leaf, strength) if is_texture(leaf) else leaf, updates)

    return update


def _rates(config: OptimiserConfig):
    def update(updates: Params, params: Params | None) -> Params:
        del params
        return jax.tree.map(
            lambda leaf: -leaf * (config.texture_rate if is_texture(leaf) else config.network_rate), updates
        )

    return update


def cosine(step: jax.Array, steps: jax.Array, *, warm_up: int = 200) -> jax.Array:
    """Factor of the learning rate: a linear rise over `warm_up` steps, then half a cosine to zero at `steps`."""
    rise = jnp.minimum(1.0, (step + 1) / warm_up)
    return rise * 0.5 * (1.0 + jnp.cos(jnp.pi * step / steps))


def staircase(step: jax.Array, steps: jax.Array, *, every: int = 10_000, factor: float = 0.9) -> jax.Array:
    """The paper's decay: times 0.9 every 10,000 steps, whatever their total."""
    del steps
    return factor ** (step // every).astype(jnp.float32)
