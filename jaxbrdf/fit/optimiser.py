"""The optimiser as a stateless transformation: Adam on smoothed gradients, a rate for textures and one for the rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import optax

from jaxbrdf.texture.angular import is_texture
from jaxbrdf.texture.multiresolution import by_resolution, summed
from jaxbrdf.texture.preconditioner import smooth, smooth_pyramid
from jaxbrdf.texture.pyramid import Pyramid, is_pyramid


@dataclass(frozen=True)
class OptimiserConfig:
    """Adam's numbers; the defaults are Timonen et al.'s (section 4.5).

    Attributes:
        texture_rate, network_rate: first learning rates.
        beta1, beta2, epsilon: Adam's.
        smoothing: A of the angular textures' preconditioner; zero leaves it out.
        multiresolution: whether angular textures are trained as sums of coarser ones (`texture.multiresolution`), each
            at the texture's rate.
        spatial_rate: first learning rate of pyramids.
        spatial_smoothing: A of their preconditioner.
    """

    texture_rate: float = 3e-3
    network_rate: float = 3e-3
    beta1: float = 0.99
    beta2: float = 0.999
    epsilon: float = 1e-15
    smoothing: float = 5.0
    multiresolution: bool = False
    spatial_rate: float = 3e-3
    spatial_smoothing: float = 10.0


def adam(config: OptimiserConfig) -> optax.GradientTransformation:
    """Preconditioned Adam whose updates still wait for the schedule's factor."""
    smoothing = [_each(_smoothed(config))] if config.smoothing or config.spatial_smoothing else []
    scaling = optax.scale_by_adam(config.beta1, config.beta2, config.epsilon)
    scaling = _by_resolution(scaling) if config.multiresolution else scaling
    return optax.chain(*smoothing, scaling, *smoothing, _each(_rated(config)))


def _each(change: Callable[[Any], Any]) -> optax.GradientTransformation:
    """What changes each array, or pyramid, by itself."""
    return optax.stateless(lambda updates, params: jax.tree.map(change, updates, is_leaf=is_pyramid))


def _by_resolution(inner: optax.GradientTransformation) -> optax.GradientTransformation:
    """The transformation of each resolution of angular textures, and of everything else, by itself."""

    def parted(tree: Any) -> Any:
        return jax.tree.map(lambda part: by_resolution(part) if _is_angular(part) else part, tree, is_leaf=is_pyramid)

    def update(updates: Any, state: Any, params: Any = None) -> tuple[Any, Any]:
        del params
        parts, state = inner.update(parted(updates), state)
        whole = jax.tree.map(
            lambda like, part: summed(part) if _is_angular(like) else part, updates, parts, is_leaf=is_pyramid
        )
        return whole, state

    return optax.GradientTransformation(lambda params: inner.init(parted(params)), update)


def _is_angular(part: Any) -> bool:
    return not is_pyramid(part) and is_texture(part)


def _smoothed(config: OptimiserConfig) -> Callable[[Any], Any]:
    """The preconditioner of an array or a pyramid."""

    def change(part: Any) -> Any:
        if isinstance(part, Pyramid):
            layout, strength = part.layout, config.spatial_smoothing
            return Pyramid(layout, smooth_pyramid(layout, part.texels, strength)) if strength else part
        return smooth(part, config.smoothing) if config.smoothing and is_texture(part) else part

    return change


def _rated(config: OptimiserConfig) -> Callable[[Any], Any]:
    """Downhill by the learning rate of an array or a pyramid."""

    def change(part: Any) -> Any:
        if isinstance(part, Pyramid):
            return Pyramid(part.layout, -config.spatial_rate * part.texels)
        return -part * (config.texture_rate if is_texture(part) else config.network_rate)

    return change


def cosine(step: jax.Array, steps: jax.Array, *, warm_up: int = 200) -> jax.Array:
    """Factor of the learning rate: a linear rise over `warm_up` steps, then half a cosine to zero at `steps`."""
    rise = jnp.minimum(1.0, (step + 1) / warm_up)
    return rise * 0.5 * (1.0 + jnp.cos(jnp.pi * step / steps))


def staircase(step: jax.Array, steps: jax.Array, *, every: int = 10_000, factor: float = 0.9) -> jax.Array:
    """The paper's decay: times 0.9 every 10,000 steps, whatever their total."""
    del steps
    return factor ** (step // every).astype(jnp.float32)
