"""The naive baseline of Timonen et al. (section 5.1): a network over the two directions as they are.

ln f = MLP(wi, wo), SiLU, 6-21-21-3. Reciprocity is learned, not built in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import turn_to_azimuth_zero
from jaxbrdf.models import mlp, output
from jaxbrdf.types import Model, Query


@dataclass(frozen=True)
class NaiveMlpConfig:
    """Sizes; the defaults are the paper's.

    Attributes:
        isotropic: both directions are turned until wo has azimuth zero.
        hidden: widths of the hidden layers.
    """

    isotropic: bool = True
    hidden: tuple[int, ...] = (21, 21)


class DirectionComponents(NamedTuple):
    """Components of wi and wo, each of the batch's shape."""

    components: tuple[jax.Array, ...]


def naive_mlp(config: NaiveMlpConfig) -> Model:
    """The naive network at the sizes of `config`; its parameters are an `Mlp`."""

    def init(key: jax.Array) -> mlp.Mlp:
        return mlp.init(key, (6, *config.hidden, 3))

    def encode(query: Query) -> DirectionComponents:
        wi, wo = query.wi, query.wo
        if config.isotropic:
            wi, wo = turn_to_azimuth_zero(wi, wo, pivot=wo)
        return DirectionComponents(tuple(w[..., axis] for w in (wi, wo) for axis in range(3)))

    def decode(params: mlp.Mlp, coordinates: DirectionComponents) -> jax.Array:
        return mlp.apply(params, jnp.stack(coordinates.components))

    return output.model(init, encode, decode)
