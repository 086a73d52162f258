"""A homogeneous medium between the interfaces of a stack, in which position is depth alone.

Depth runs from 0 at the top to 1 at the bottom; a ray that goes the length s crosses s |cos| of it. Lengths are in the
medium's thickness, so coefficients are optical depths along the normal. Light is taken by absorption and redirected by
scattering with the phase function of Henyey and Greenstein (1941).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.directions import dot
from jaxbrdf.core.numerics import match_rank, safe_divide, safe_sqrt
from jaxbrdf.core.ranges import Range

DEPTH = Range(0.0, np.inf)
"""Of optical depths."""

ASYMMETRY = Range(-0.99, 0.99)
"""Of the mean cosine of scattering; beyond, the phase function is a line that no random direction meets."""


class Medium(NamedTuple):
    """Optical depths along the normal for R, G and B, `(3,)` or `(..., 3)`, None where there is no such effect.

    Attributes:
        absorption: sigma_a times the thickness.
        scattering: sigma_s times the thickness.
        asymmetry: mean cosine of scattering, positive forwards, `()` or `(...)`; None is zero.
    """

    absorption: Annotated[jax.Array, DEPTH] | None = None
    scattering: Annotated[jax.Array, DEPTH] | None = None
    asymmetry: Annotated[jax.Array, ASYMMETRY] | None = None


class Flight(NamedTuple):
    """A stretch of a ray: whether it `scattered` before the boundary, at which `depth`, the flux `kept` `(..., 3)`."""

    scattered: jax.Array
    depth: jax.Array
    kept: jax.Array


def transmittance(medium: Medium | None, depth: jax.Array, w: jax.Array) -> jax.Array:
    """Share of the light along w that crosses this much depth unscattered, `(..., 3)`: exp(-optical depth / |cos|)."""
    if medium is None:
        return jnp.ones_like(w)
    stretch = (depth / _steepness(w))[..., None]
    parts = [match_rank(part, w.ndim) for part in medium[:2] if part is not None]
    return jnp.exp(-stretch * sum(parts)) if parts else jnp.ones_like(w)


def fly(medium: Medium, depth: jax.Array, w: jax.Array, u: jax.Array) -> Flight:
    """From a depth along w to the next scattering or the boundary; the medium must scatter.

    One channel, chosen evenly, draws the stretch, and all three are weighed by the mean of their densities: no weight
    exceeds three. Absorption is not drawn but weighs.

    Args:
        u: uniform in [0, 1), `(2, ...)`: for the channel and the stretch.
    """
    assert medium.scattering is not None
    steep = _steepness(w)
    boundary = jnp.where(w[..., 2] > 0, depth, 1.0 - depth) / steep
    rate = jnp.broadcast_to(match_rank(medium.scattering, w.ndim), w.shape)
    channel = jnp.minimum((3.0 * u[0]).astype(jnp.int32), 2)
    own = jnp.take_along_axis(rate, channel[..., None], axis=-1)[..., 0]
    drawn = jnp.where(own > 0, safe_divide(-jnp.log1p(-u[1]), own), jnp.inf)
    scattered = drawn < boundary
    stretch = jnp.where(scattered, drawn, boundary)[..., None]
    # each channel's density over their mean, in a form in which the exponentials do not vanish together
    chance = jnp.where(scattered[..., None], rate, 1.0)
    relative = jnp.exp(jnp.minimum((rate[..., :, None] - rate[..., None, :]) * stretch[..., None], 80.0))
    kept = safe_divide(3.0 * chance, jnp.sum(relative * chance[..., None, :], axis=-1))
    if medium.absorption is not None:
        kept = kept * jnp.exp(-match_rank(medium.absorption, w.ndim) * stretch)
    return Flight(scattered, jnp.clip(depth - stretch[..., 0] * w[..., 2], 0.0, 1.0), kept)


def phase(medium: Medium, wi: jax.Array, wo: jax.Array) -> jax.Array:
    """p(wi, wo) = (1 - g^2) / (4 pi (1 + g^2 - 2 g mu)^(3/2)) [1/sr], mu = -wi . wo as both leave the point."""
    if medium.asymmetry is None:
        return jnp.full_like(wi[..., 2], 0.25 / jnp.pi)
    g, mu = medium.asymmetry, -dot(wi, wo)
    squared = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - mu)
    return 0.25 / jnp.pi * (1.0 - g) * (1.0 + g) / (squared * jnp.sqrt(squared))


def sample_phase(medium: Medium, wo: jax.Array, u: jax.Array) -> jax.Array:
    """wi of density `phase`, for u uniform in [0, 1), `(2, ...)`.

    The usual inversion of the cosine, with s = 2 u - 1 and its division by g carried out.
    """
    s = 2.0 * u[0] - 1.0
    mu = s
    if medium.asymmetry is not None:
        g = medium.asymmetry
        raised = 1.0 + g * s
        mu = (2.0 * s * (1.0 + g * g) + g * (3.0 + s * s) - g * g * g * (1.0 - s * s)) / (2.0 * raised * raised)
    return _about(-wo, jnp.clip(mu, -1.0, 1.0), 2.0 * jnp.pi * u[1])


def _steepness(w: jax.Array) -> jax.Array:
    """|cos|, at least the dtype's epsilon: a ray along the layer goes far, but not infinitely."""
    return jnp.maximum(jnp.abs(w[..., 2]), jnp.finfo(w.dtype).eps)


def _about(axis: jax.Array, cos: jax.Array, phi: jax.Array) -> jax.Array:
    """The unit vector at this cosine and azimuth about `axis` (basis of Duff et al. 2017)."""
    x, y, z = axis[..., 0], axis[..., 1], axis[..., 2]
    sign = jnp.where(z < 0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    tangent = jnp.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    bitangent = jnp.stack([b, sign + y * y * a, -y], axis=-1)
    sin = safe_sqrt((1.0 - cos) * (1.0 + cos))
    return (
        (sin * jnp.cos(phi))[..., None] * tangent + (sin * jnp.sin(phi))[..., None] * bitangent + cos[..., None] * axis
    )
