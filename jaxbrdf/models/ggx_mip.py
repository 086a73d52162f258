"""A mip map of GGX parameters, each level of which is fitted by itself: what microfacets alone make of all scales.

As Timonen et al. run it (section 5.2, baseline 4), after Gauthier et al. (2022) and Kemppinen et al. (2023). The twelve
numbers T(S, uv, J) become, after filtering,

    three   specular colour, sigmoid          three   diffuse colour, sigmoid
    three   normal                            three   roughness matrix (a, b, c)

and f is that of a Lambert body and a GGX lobe of Schlick's reflectance about that normal, masking and shadowing
correlated by height. Like the targets of reciprocal models it is the reciprocal part of normal mapping
(`jaxbrdf.brdf.normal_mapped`). Zeros are a plain dielectric, and that is where it starts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logit

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams
from jaxbrdf.brdf.normal_mapped import NormalMappedParams, reciprocal_normal_mapped
from jaxbrdf.core.fresnel import Schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.numerics import safe_divide, safe_normalize
from jaxbrdf.core.roughness import LEAST_FILTERED, Tensor, largest_c
from jaxbrdf.models import spatial
from jaxbrdf.models.spatial import LatentTexture, SpatialCoordinates
from jaxbrdf.texture.pyramid import Pyramid
from jaxbrdf.types import Brdf, Model, Query

CHANNELS = 12

LEAST_VALUE = 1e-12
"""Of f [1/sr], added before the logarithm: a millionth of the loss's own 1e-6 (Timonen et al., section 4.4)."""

FIRST_SPECULAR, FIRST_ROUGHNESS = -3.2, -1.1
"""Logits of 0.04, a dielectric's, and of 0.25."""

LOGIT_RANGE = (1e-3, 0.999)
"""Of shares that raw numbers are found for: beyond it a sigmoid's slope is less than a thousandth, and a texel that
starts there would hardly move."""

FIRST_HEIGHT = float(np.log(np.expm1(1.0)))
"""Of which softplus is one."""


PAPER_CHANNELS = LatentTexture(channels=CHANNELS)


@dataclass(frozen=True)
class GgxMipConfig:
    """The pyramid; twelve channels.

    Raises:
        ValueError: if they are not twelve.
    """

    latents: LatentTexture = PAPER_CHANNELS

    def __post_init__(self) -> None:
        if self.latents.channels != CHANNELS:
            raise ValueError(f"latents.channels is {CHANNELS}, not {self.latents.channels}")


class GgxMipParams(NamedTuple):
    """s: the pyramid of raw numbers."""

    s: Pyramid


class BodyAndLobe(NamedTuple):
    """A diffuse body and a microfacet lobe."""

    body: LambertParams
    lobe: MicrofacetParams


def ggx_mip(config: GgxMipConfig) -> Model:
    """The model at the size of `config`."""
    layout = config.latents.layout

    def init(key: jax.Array) -> GgxMipParams:
        del key
        return GgxMipParams(Pyramid(layout, jnp.zeros((layout.texels, CHANNELS))))

    def decode(params: GgxMipParams, coordinates: SpatialCoordinates) -> jax.Array:
        numbers = spatial.latents_at(params.s, coordinates, probes=config.latents.probes)
        f = SHADED.eval(valid(numbers), Query(coordinates.wi.T, coordinates.wo.T))
        return jnp.log(f + LEAST_VALUE).T

    return spatial.spatial_model(init, decode)


def valid(numbers: jax.Array) -> NormalMappedParams:
    """Parameters of any raw numbers `(12, batch)`.

    The normal is (x, y, softplus(z)) over its length: on the upper hemisphere. a and b are between `LEAST_FILTERED` and
    1, and c is a share of what they leave it (`jaxbrdf.core.roughness.largest_c`), so that both eigenvalues are too.
    """
    specular, diffuse, normal, roughness = jnp.split(numbers, 4)
    lobe = MicrofacetParams(Ggx(_tensor(roughness)), Schlick(jax.nn.sigmoid(FIRST_SPECULAR + specular).T))
    body = LambertParams(jax.nn.sigmoid(diffuse).T)
    upward = jnp.stack([normal[0], normal[1], jax.nn.softplus(FIRST_HEIGHT + normal[2])], axis=-1)
    return NormalMappedParams(safe_normalize(upward), BodyAndLobe(body, lobe))


def raw_numbers(specular: jax.Array, diffuse: jax.Array, tilt: jax.Array, roughness: Tensor) -> jax.Array:
    """The inverse of `valid`, `(n, 12)`, of values that it can give, or of the nearest within `LOGIT_RANGE`.

    Args:
        specular, diffuse: colours `(n, 3)`.
        tilt: x / z and y / z of the normal, `(n, 2)`.
        roughness: the matrix, entries `(n,)`.
    """
    a, b = (jnp.clip((x - LEAST_FILTERED) / (1.0 - LEAST_FILTERED), *LOGIT_RANGE) for x in roughness[:2])
    largest = largest_c(*(LEAST_FILTERED + (1.0 - LEAST_FILTERED) * x for x in (a, b)), least=LEAST_FILTERED)
    share = jnp.clip(safe_divide(roughness.c, largest), -LOGIT_RANGE[1], LOGIT_RANGE[1])
    return jnp.concatenate(
        [
            logit(jnp.clip(specular, *LOGIT_RANGE)) - FIRST_SPECULAR,
            logit(jnp.clip(diffuse, *LOGIT_RANGE)),
            tilt,
            jnp.zeros_like(tilt[:, :1]),
            jnp.stack([logit(a) - FIRST_ROUGHNESS, logit(b) - FIRST_ROUGHNESS, jnp.arctanh(share)], axis=1),
        ],
        axis=1,
    )


def _tensor(numbers: jax.Array) -> Tensor:
    a, b = (LEAST_FILTERED + (1.0 - LEAST_FILTERED) * jax.nn.sigmoid(FIRST_ROUGHNESS + x) for x in numbers[:2])
    return Tensor(a, b, jnp.tanh(numbers[2]) * largest_c(a, b, least=LEAST_FILTERED))


def _eval(params: BodyAndLobe, query: Query) -> jax.Array:
    return LAMBERT.eval(params.body, query) + MICROFACET.eval(params.lobe, query)


SHADED = reciprocal_normal_mapped(Brdf(_eval))
