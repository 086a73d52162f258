"""Spatial textures: the values of a pyramid at texture coordinates, as docs/conventions.md has them under Textures.

Coordinates uv are `(..., 2)`, a pyramid is `(texels, channels)`, and values are `(..., channels)`. A NaN among uv, lod
or footprint of a place makes its value NaN. Derivatives are of first order and in reverse mode, by the texels and by
uv. Their transposes are written out: they need one array of the pyramid's size, where derived ones make one for each
texel that a place reads.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jaxbrdf.core.staging import staged
from jaxbrdf.texture.cell import along_slopes, cell, fetch, in_period, scatter
from jaxbrdf.texture.footprint import ellipse, lod_of, probes_of
from jaxbrdf.texture.probed import probed
from jaxbrdf.texture.pyramid import Layout, between_levels, check_level, check_texels

Share = tuple[jax.Array, jax.Array]
"""A level, and how much of a lookup is read there, each `(batch,)` or one for all."""


def bilinear(layout: Layout, texels: jax.Array, uv: jax.Array, *, level: int = 0) -> jax.Array:
    """Linear between the four texels around uv on one level.

    Raises:
        ValueError: if there is no such level, or the texels are not of the layout.
    """
    check_level(layout, level)
    return _shared(layout, texels, uv, (jnp.int32(level), jnp.ones(uv.shape[:-1], uv.dtype)))


def trilinear(layout: Layout, texels: jax.Array, uv: jax.Array, lod: jax.Array) -> jax.Array:
    """Linear also between the two levels around `lod`, `(...)`, by which it is differentiable too.

    A lod outside the pyramid is its first or its last level.

    Raises:
        ValueError: if the texels are not of the layout.
    """
    below, share = between_levels(layout, lod)
    return _shared(layout, texels, uv, (below, 1.0 - share), (jnp.minimum(below + 1, layout.top), share))


def stochastic(layout: Layout, texels: jax.Array, uv: jax.Array, lod: jax.Array, u: jax.Array) -> jax.Array:
    """`bilinear` on one of the two levels around `lod`, drawn by `u` in [0, 1): in the mean it is `trilinear`.

    Half the reads, for noise that the samples of a path tracer take in. Not differentiable in `lod`.

    Args:
        layout, texels, uv: as elsewhere.
        lod: the fractional level, `(...)`.
        u: uniform numbers, `(...)`.

    Raises:
        ValueError: if the texels are not of the layout.
    """
    below, share = between_levels(layout, jax.lax.stop_gradient(lod))
    # one, or NaN
    whole = 1.0 + 0.0 * share
    return _shared(layout, texels, uv, (jnp.where(u < share, below + 1, below), whole))


def anisotropic(
    layout: Layout, texels: jax.Array, uv: jax.Array, footprint: jax.Array, *, probes: int = 16
) -> jax.Array:
    """Mean under a footprint: as many `trilinear` lookups along its major axis as it is long for its width.

    The lookup's covariance is the footprint's (`jaxbrdf.texture.footprint`), but no less than a texel's, and at most
    `probes` times as long as wide. With one probe it is isotropic and no loop is compiled: it is then as wide as the
    footprint is long, the limit of the same rule and how OpenGL chooses a mip map, whose blur at grazing angles Timonen
    et al. show in section 6.1. A footprint of zero is `bilinear`; one beyond the pyramid, be it infinite, is its last
    level.

    Args:
        layout, texels, uv: as elsewhere.
        footprint: `(..., 2, 2)`, takes the unit filter, a Gaussian of standard deviation 1/2, to uv; the derivative by
            it is zero.
        probes: the largest number of lookups.

    Raises:
        ValueError: if `probes` is not positive, or the texels are not of the layout.
    """
    if probes < 1:
        raise ValueError(f"probes is at least 1, not {probes}")
    footprint = jax.lax.stop_gradient(footprint)
    if probes == 1:
        return trilinear(layout, texels, uv, staged(lod_of(layout, ellipse(layout, footprint).major)))
    check_texels(layout, texels)
    asked = probes_of(layout, footprint.reshape(-1, 2, 2), most=probes)
    # in one period before the steps are added, which would lose their digits far outside
    centre = in_period(layout.wrap, uv.reshape(-1, 2))
    return probed(layout, texels, centre, asked).reshape(*uv.shape[:-1], texels.shape[1])


def _shared(layout: Layout, texels: jax.Array, uv: jax.Array, *shares: Share) -> jax.Array:
    check_texels(layout, texels)
    flat = tuple((level.reshape(-1) if level.ndim else level, share.reshape(-1)) for level, share in shares)
    return _mixed(layout, texels, uv.reshape(-1, 2), flat).reshape(*uv.shape[:-1], texels.shape[1])


@jax.custom_vjp
def _mixed(layout: Layout, texels: jax.Array, uv: jax.Array, shares: tuple[Share, ...]) -> jax.Array:
    """Bilinear values on several levels times their shares, added; differentiable in all but the levels."""
    parts = [fetch(texels, cell(layout, uv[:, 0], uv[:, 1], level)) * share[:, None] for level, share in shares]
    return sum(parts[1:], parts[0])


def _mixed_forward(layout: Layout, texels: jax.Array, uv: jax.Array, shares: tuple[Share, ...]):
    return _mixed(layout, texels, uv, shares), (layout, texels, uv, shares)


def _mixed_backward(saved: tuple[Layout, jax.Array, jax.Array, tuple[Share, ...]], g: jax.Array):
    layout, texels, uv, shares = saved
    by_texels, by_uv, by_shares = jnp.zeros_like(texels), jnp.zeros_like(uv), []
    for level, share in shares:
        at, rows = cell(layout, uv[:, 0], uv[:, 1], level), g * share[:, None]
        by_texels = scatter(by_texels, at, rows)
        by_uv = by_uv + along_slopes(texels, at, rows)
        by_shares.append((None, jnp.sum(g * fetch(texels, at), axis=1)))
    return None, by_texels, by_uv, tuple(by_shares)


_mixed.defvjp(_mixed_forward, _mixed_backward)
