"""The NBRDF baseline of Timonen et al. (section 5.1): a network over the half and the difference vector.

ln f = MLP(wh, wd), SiLU, 6-14-14-14-3. It is not the published Neural-BRDF of Sztrajman et al. (6-21-21-3, ReLU,
exp - 1), which is `jaxbrdf.brdf.published_nbrdf`. Reciprocity is learned, not built in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.directions import half_difference, sin_theta
from jaxbrdf.models import mlp, output
from jaxbrdf.types import Model, Query


@dataclass(frozen=True)
class NbrdfConfig:
    """Sizes; the defaults are the paper's.

    Attributes:
        isotropic: the half vector enters with azimuth zero.
        hidden: widths of the hidden layers.
    """

    isotropic: bool = True
    hidden: tuple[int, ...] = (14, 14, 14)


class HalfDifferenceComponents(NamedTuple):
    """Components of wh and wd, each of the batch's shape."""

    components: tuple[jax.Array, ...]


def nbrdf(config: NbrdfConfig) -> Model:
    """The NBRDF baseline at the sizes of `config`; its parameters are an `Mlp`."""

    def init(key: jax.Array) -> mlp.Mlp:
        return mlp.init(key, (6, *config.hidden, 3))

    def encode(query: Query) -> HalfDifferenceComponents:
        wh, wd = half_difference(query.wi, query.wo)
        if config.isotropic:
            wh = jnp.stack([sin_theta(wh), jnp.zeros_like(wh[..., 1]), wh[..., 2]], axis=-1)
        return HalfDifferenceComponents(tuple(w[..., axis] for w in (wh, wd) for axis in range(3)))

    def decode(params: mlp.Mlp, coordinates: HalfDifferenceComponents) -> jax.Array:
        return mlp.apply(params, jnp.stack(coordinates.components))

    return output.model(init, encode, decode)
