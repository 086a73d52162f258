"""Models over a surface at sizes for tests, with random parameters and queries."""

from __future__ import annotations

from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.models.ggx_mip import GgxMipConfig
from jaxbrdf.models.half_difference import TextureSizes
from jaxbrdf.models.neumip import NeumipConfig
from jaxbrdf.models.spatial import LatentTexture
from jaxbrdf.models.spatial_gated import SpatialGatedConfig
from jaxbrdf.models.spatial_tripleplane import SpatialTripleplaneConfig
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.models.zeltner import ZeltnerConfig
from jaxbrdf.types import Model, Params, Query

COUNT = 512
"""Of queries: each evaluation is compiled for one size."""

LATENTS = LatentTexture(8, 8, channels=4, probes=4)
TEXTURES = TextureSizes(isotropic=False, h_radii=5, h_azimuths=6, d_radii=4, d_azimuths=6, channels=3)

SMALL: dict[str, Any] = {
    "gated": SpatialGatedConfig(LATENTS, TEXTURES, (6,)),
    "tripleplane": SpatialTripleplaneConfig(LATENTS, TEXTURES, (6,)),
    "zeltner": ZeltnerConfig(LATENTS, 2, (6,)),
    "neumip": NeumipConfig(LATENTS, (6,), LatentTexture(8, 8, channels=3, levels=1), (5,)),
    "ggx-mip": GgxMipConfig(LatentTexture(8, 8, channels=12, probes=4)),
}


@cache
def small(name: str) -> Model:
    """The model of a name at its small size."""
    return SPATIAL[name].build(SMALL[name])


def random_params(seed: int, model: Model, *, deviation: float = 0.5) -> Params:
    """Every number drawn, none at its first value."""
    rng = np.random.default_rng(seed)
    shapes = jax.eval_shape(model.init, jax.random.key(0))
    return jax.tree.map(lambda leaf: jnp.asarray(deviation * rng.normal(size=leaf.shape), jnp.float32), shapes)


def queries(seed: int, count: int) -> Query:
    """Directions over the hemisphere, places over several periods, and footprints of all sizes and shapes."""
    rng = np.random.default_rng(seed)
    w = rng.normal(size=(2, count, 3))
    w[..., 2] = np.abs(w[..., 2])
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    size = 10.0 ** rng.uniform(-3, 0, (count, 1, 1))
    numbers = (*w, rng.uniform(-2, 2, (count, 2)), size * rng.normal(size=(count, 2, 2)))
    return Query(*(jnp.asarray(x, jnp.float32) for x in numbers))


def swapped(query: Query) -> Query:
    """The same with light and viewer exchanged."""
    return query._replace(wi=query.wo, wo=query.wi)
