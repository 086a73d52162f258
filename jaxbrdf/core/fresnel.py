"""Fresnel reflectance of unpolarised light at a smooth interface, and the records that carry its parameters.

Every function takes the cosine between the light and the (micro)facet normal, in [0, 1], and broadcasts over it. The
records are pytrees of arrays whose type says which law holds, so a traced function never asks for a name.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.numerics import match_rank, safe_divide, safe_sqrt, tiny
from jaxbrdf.core.ranges import SHARE, Range

INDEX = Range(1e-3, 1e3)
"""Of refractive indices over that of the incident side. Below one, light comes from the denser side and can be
reflected totally; an index and its reciprocal are the two sides of one interface, so the range is its own mirror."""

EXTINCTION = Range(0.0, 1e3)
"""Of the imaginary part of a refractive index; zero is a transparent medium."""

LOW_INDEX = 0.7
"""Below it eta^2 - sin^2 keeps more digits than (eta^2 - 1) + cos^2, whose bracket is then nearer to -1 than to 0."""

F82 = 1.0 / 7.0
"""Cosine at which `schlick_f82` takes its tint, about 82 degrees: where metals dip furthest below Schlick's curve."""


def schlick(cos: jax.Array, f0: jax.Array) -> jax.Array:
    """F = f0 + (1 - f0)(1 - cos)^5 (Schlick 1994, Eq. 15)."""
    grazing = 1.0 - cos
    square = grazing * grazing
    return f0 + (1.0 - f0) * square * square * grazing


def schlick_f82(cos: jax.Array, f0: jax.Array, tint: jax.Array) -> jax.Array:
    """Schlick's curve less a term that takes it to tint times itself at the cosine 1/7, and is zero at 0 and 1.

    F = schlick(cos) - b cos (1 - cos)^6, the error term of Lazanyi and Szirmay-Kalos (2005), with b given by the tint
    as in Kutz et al. (2021). It is below zero where both f0 and the tint are small, and cut there.
    """
    grazing = 1.0 - cos
    cube = grazing * grazing * grazing
    lowered = schlick(jnp.asarray(F82, f0.dtype), f0) * (1.0 - tint) / (F82 * (1.0 - F82) ** 6)
    return jnp.maximum(schlick(cos, f0) - lowered * cos * cube * cube, 0.0)


def dielectric(cos: jax.Array, eta: jax.Array) -> jax.Array:
    """Exact reflectance between transparent media, one under total internal reflection.

    With g^2 = eta^2 - 1 + cos^2 the two polarisations reflect ((cos - g) / (cos + g))^2 and
    ((eta^2 cos - g) / (eta^2 cos + g))^2 (Walter et al. 2007, Eq. 22, split by polarisation).

    Args:
        cos: cosine on the incident side.
        eta: refractive index of the far side over that of the incident side.
    """
    excess = (eta - 1.0) * (eta + 1.0)
    # each where it does not cancel: for a low index g^2 is left of two numbers near one
    g_squared = jnp.where(eta < LOW_INDEX, eta * eta - (1.0 - cos) * (1.0 + cos), excess + cos * cos)
    g = safe_sqrt(g_squared)
    difference = _difference(cos, g, -excess)
    near_one = jnp.abs(excess) < 0.5
    across = _ratio(difference, cos + g)
    along = _ratio(jnp.where(near_one, excess * cos + difference, eta * eta * cos - g), eta * eta * cos + g)
    return jnp.where(g_squared > 0, 0.5 * (across * across + along * along), jnp.where(eta == 1.0, 0.0, 1.0))


def conductor(cos: jax.Array, eta: jax.Array, k: jax.Array) -> jax.Array:
    """Exact reflectance of an absorbing medium of index eta + i k, relative to the incident side.

    sqrt((eta + i k)^2 - sin^2) = a + i b gives |r|^2 of both polarisations in real arithmetic (Born and Wolf,
    Principles of Optics, 14.2). For metals eta^2 - k^2 is large and negative, and a^2 = (|a + ib|^2 + Re) / 2 would
    cancel; the conjugate form is used on that side.
    """
    sin_squared = (1.0 - cos) * (1.0 + cos)
    a, b = normal_component(cos, eta, k)
    behind = b * b
    difference = _difference(cos, a, k * k - (eta - 1.0) * (eta + 1.0) - behind)
    across = _ratio(difference * difference + behind, _squared(cos + a) + behind)
    turned = behind * cos * cos
    along = _ratio(_squared(a * cos - sin_squared) + turned, _squared(a * cos + sin_squared) + turned)
    # at normal incidence the two are one, and where neither cosine is left there is no interface
    return 0.5 * (across + across * along)


def normal_component(cos: jax.Array, eta: jax.Array, k: jax.Array) -> tuple[jax.Array, jax.Array]:
    """a, b of a + i b = sqrt((eta + i k)^2 - sin^2): the wave's component along the normal, over its size outside.

    For metals eta^2 - k^2 is large and negative, and a^2 = (|a + ib|^2 + Re) / 2 would cancel; the conjugate form is
    used on that side, and for b on the other.
    """
    low = (eta < LOW_INDEX) & (k < LOW_INDEX)
    near_one = (eta - 1.0) * (eta + 1.0) - k * k + cos * cos
    real = jnp.where(low, (eta - k) * (eta + k) - (1.0 - cos) * (1.0 + cos), near_one)
    imaginary = 2.0 * eta * k
    sum_ = safe_sqrt(real * real + imaginary * imaginary) + jnp.abs(real)
    larger, smaller = 0.5 * sum_, 0.5 * safe_divide(imaginary * imaginary, sum_)
    forward = real >= 0
    return safe_sqrt(jnp.where(forward, larger, smaller)), safe_sqrt(jnp.where(forward, smaller, larger))


def _difference(cos: jax.Array, a: jax.Array, of_squares: jax.Array) -> jax.Array:
    """cos - a, by the difference of their squares, known apart, where the two are close."""
    close = jnp.abs(of_squares) < 0.5 * cos * cos
    return jnp.where(close, _ratio(of_squares, cos + a), cos - a)


def _ratio(part: jax.Array, whole: jax.Array) -> jax.Array:
    """part / whole, zero where the square of the whole, by which the gradient is divided, is no normal number."""
    usable = jnp.abs(whole) > jnp.sqrt(tiny(whole))
    return jnp.where(usable, part / jnp.where(usable, whole, 1.0), 0.0)


def _squared(x: jax.Array) -> jax.Array:
    return x * x


def diffuse_reflectance(eta: jax.Array, *, nodes: int = 32) -> jax.Array:
    """Share of diffuse light that a dielectric interface reflects, the integral of 2 cos F(cos) over cos in [0, 1].

    Gauss-Legendre quadrature in sqrt(cos), where F is smooth at grazing angles; error below 1e-6 for eta in [1, 3].
    """
    points, weights = np.polynomial.legendre.leggauss(nodes)
    root, weights = 0.5 * (points + 1.0), 0.5 * weights
    eta = jnp.asarray(eta)
    cos = jnp.asarray(root**2, eta.dtype)
    mass = jnp.asarray(weights * 4.0 * root**3, eta.dtype)
    lifted = eta[..., None]
    return jnp.sum(match_rank(mass, lifted.ndim) * dielectric(match_rank(cos, lifted.ndim), lifted), axis=-1)


class Fresnel(Protocol):
    """What a microfacet lobe needs to know of its interface."""

    def reflectance(self, cos: jax.Array) -> jax.Array:
        """RGB reflectance `(..., 3)` at the cosine `(...)`."""
        ...


class Schlick(NamedTuple):
    """f0: reflectance at normal incidence, `(3,)` or `(..., 3)`."""

    f0: Annotated[jax.Array, SHARE]

    def reflectance(self, cos: jax.Array) -> jax.Array:
        return schlick(cos[..., None], match_rank(self.f0, cos.ndim + 1))


class SchlickF82(NamedTuple):
    """f0: reflectance at normal incidence; tint: share that is left at the cosine 1/7; each `(3,)` or `(..., 3)`."""

    f0: Annotated[jax.Array, SHARE]
    tint: Annotated[jax.Array, SHARE]

    def reflectance(self, cos: jax.Array) -> jax.Array:
        rank = cos.ndim + 1
        return schlick_f82(cos[..., None], match_rank(self.f0, rank), match_rank(self.tint, rank))


class Dielectric(NamedTuple):
    """eta: refractive index over that of the outside, `()` or `(...)`."""

    eta: Annotated[jax.Array, INDEX]

    def reflectance(self, cos: jax.Array) -> jax.Array:
        grey = dielectric(cos, self.eta)
        return jnp.broadcast_to(grey[..., None], (*grey.shape, 3))


class Conductor(NamedTuple):
    """eta, k: real and imaginary part of the refractive index for R, G and B, `(3,)` or `(..., 3)`."""

    eta: Annotated[jax.Array, INDEX]
    k: Annotated[jax.Array, EXTINCTION]

    def reflectance(self, cos: jax.Array) -> jax.Array:
        rank = cos.ndim + 1
        return conductor(cos[..., None], match_rank(self.eta, rank), match_rank(self.k, rank))
