"""Fresnel reflectance of unpolarised light at a smooth interface, and the records that carry its parameters.

Every function takes the cosine between the light and the (micro)facet normal, in [0, 1], and broadcasts over it. The
records are pytrees of arrays whose type says which law holds, so a traced function never asks for a name.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.numerics import match_rank, safe_divide, safe_sqrt


def schlick(cos: jax.Array, f0: jax.Array) -> jax.Array:
    """F = f0 + (1 - f0)(1 - cos)^5 (Schlick 1994, Eq. 15)."""
    grazing = 1.0 - cos
    square = grazing * grazing
    return f0 + (1.0 - f0) * square * square * grazing


def dielectric(cos: jax.Array, eta: jax.Array) -> jax.Array:
    """Exact reflectance between transparent media, one under total internal reflection.

    With g^2 = eta^2 - 1 + cos^2 the two polarisations reflect ((cos - g) / (cos + g))^2 and
    ((eta^2 cos - g) / (eta^2 cos + g))^2 (Walter et al. 2007, Eq. 22, split by polarisation).

    Args:
        cos: cosine on the incident side.
        eta: refractive index of the far side over that of the incident side.
    """
    g_squared = (eta - 1.0) * (eta + 1.0) + cos * cos
    g = safe_sqrt(g_squared)
    across = safe_divide(cos - g, cos + g)
    along = safe_divide(eta * eta * cos - g, eta * eta * cos + g)
    return jnp.where(g_squared > 0, 0.5 * (across * across + along * along), jnp.where(eta == 1.0, 0.0, 1.0))


def conductor(cos: jax.Array, eta: jax.Array, k: jax.Array) -> jax.Array:
    """Exact reflectance of an absorbing medium of index eta + i k, relative to the incident side.

    sqrt((eta + i k)^2 - sin^2) = a + i b gives |r|^2 of both polarisations in real arithmetic (Born and Wolf,
    Principles of Optics, 14.2). For metals eta^2 - k^2 is large and negative, and a^2 = (|a + ib|^2 + Re) / 2 would
    cancel; the conjugate form is used on that side.
    """
    cos_squared = cos * cos
    sin_squared = (1.0 - cos) * (1.0 + cos)
    real = (eta - 1.0) * (eta + 1.0) - k * k + cos_squared
    imaginary = 2.0 * eta * k
    modulus = safe_sqrt(real * real + imaginary * imaginary)
    cancelling = real < 0
    sum_ = modulus + jnp.abs(real)
    a = safe_sqrt(0.5 * jnp.where(cancelling, safe_divide(imaginary * imaginary, sum_), sum_))
    cross = 2.0 * a * cos
    across = _ratio(modulus + cos_squared, cross)
    along = across * _ratio(modulus * cos_squared + sin_squared * sin_squared, cross * sin_squared)
    return 0.5 * (across + along)


def _ratio(even: jax.Array, odd: jax.Array) -> jax.Array:
    """(even - odd) / (even + odd), one where both vanish."""
    whole = even + odd
    return jnp.where(whole > 0, safe_divide(even - odd, whole), 1.0)


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

    f0: jax.Array

    def reflectance(self, cos: jax.Array) -> jax.Array:
        return schlick(cos[..., None], match_rank(self.f0, cos.ndim + 1))


class Dielectric(NamedTuple):
    """eta: refractive index over that of the outside, `()` or `(...)`."""

    eta: jax.Array

    def reflectance(self, cos: jax.Array) -> jax.Array:
        grey = dielectric(cos, self.eta)
        return jnp.broadcast_to(grey[..., None], (*grey.shape, 3))


class Conductor(NamedTuple):
    """eta, k: real and imaginary part of the refractive index for R, G and B, `(3,)` or `(..., 3)`."""

    eta: jax.Array
    k: jax.Array

    def reflectance(self, cos: jax.Array) -> jax.Array:
        rank = cos.ndim + 1
        return conductor(cos[..., None], match_rank(self.eta, rank), match_rank(self.k, rank))
