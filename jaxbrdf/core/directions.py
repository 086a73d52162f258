"""Unit vectors in the local frame: z is the geometric normal, x the tangent."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.core.numerics import safe_atan2, safe_divide, safe_norm, safe_normalize, safe_sqrt

Components = tuple[jax.Array, jax.Array, jax.Array]
"""x, y and z of vectors, `(...)` each."""


LEAST_SINE = 1e-18
"""Of a half vector that has an azimuth: float32 loses the squares of smaller components, and wider numbers follow, or
the azimuth, which has no limit at the pole, would depend on the precision."""


class HalfDifference(NamedTuple):
    """Half vector and difference vector after Rusinkiewicz (1998), each `(..., 3)`."""

    wh: jax.Array
    wd: jax.Array


def components(w: jax.Array) -> Components:
    """x, y and z of w."""
    return w[..., 0], w[..., 1], w[..., 2]


def cos_theta(w: jax.Array) -> jax.Array:
    """Cosine between w and the normal, `(...)`."""
    return w[..., 2]


def dot(a: jax.Array, b: jax.Array) -> jax.Array:
    """Inner product over the last axis, `(...)`, spelled out: a reduction over three numbers is ten times slower."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def spherical(theta: jax.Array, phi: jax.Array) -> jax.Array:
    """Unit vector with polar angle theta and azimuth phi, both in radians, `(..., 3)`."""
    s = jnp.sin(theta)
    return jnp.stack([s * jnp.cos(phi), s * jnp.sin(phi), jnp.cos(theta)], axis=-1)


def azimuth(w: jax.Array) -> jax.Array:
    """Angle of w about the normal in (-pi, pi], zero at the pole."""
    return safe_atan2(w[..., 1], w[..., 0])


def reflect(w: jax.Array, about: jax.Array) -> jax.Array:
    """Mirror image of w about the unit vector `about`."""
    return 2.0 * dot(w, about)[..., None] * about - w


def half_vector(wi: jax.Array, wo: jax.Array) -> jax.Array:
    """Normalised wi + wo; the normal where the two are opposed."""
    return safe_normalize(wi + wo)


def above_horizon(wi: jax.Array, wo: jax.Array) -> jax.Array:
    """Whether both directions leave the front of the surface."""
    return (cos_theta(wi) > 0) & (cos_theta(wo) > 0)


def half_difference(wi: jax.Array, wo: jax.Array) -> HalfDifference:
    """Half and difference vectors: wd = Ry(-theta_h) Rz(-phi_h) wi (Rusinkiewicz 1998).

    Swapping wi and wo keeps wh and turns wd by pi about z, to the last bit. Where wh is the
    normal, within `LEAST_SINE`, phi_h is zero.
    """
    wh, wd = half_difference_components(*sum_and_half_difference(components(wi), components(wo)))
    return HalfDifference(jnp.stack(wh, axis=-1), jnp.stack(wd, axis=-1))


def sum_and_half_difference(wi: Components, wo: Components) -> tuple[Components, Components]:
    """wi + wo and (wi - wo) / 2: exact where the two are almost opposed, or almost meet."""
    both = wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]
    return both, (0.5 * (wi[0] - wo[0]), 0.5 * (wi[1] - wo[1]), 0.5 * (wi[2] - wo[2]))


def half_difference_components(both: Components, across: Components) -> tuple[Components, Components]:
    """`half_difference` of the sum wi + wo and of (wi - wo) / 2, whose components are arrays of their own, `(...)`."""
    wh = _normalised(both)
    sin_h, cos_h = safe_sqrt(wh[0] * wh[0] + wh[1] * wh[1]), wh[2]
    at_pole = sin_h < LEAST_SINE
    cos_phi = jnp.where(at_pole, 1.0, safe_divide(wh[0], sin_h))
    sin_phi = jnp.where(at_pole, 0.0, safe_divide(wh[1], sin_h))
    # The turned wi and wo differ in the sign of x and y alone, so x and y are those of (wi - wo) / 2. Where the two
    # almost meet their difference is exact and x and y keep their digits; turning wi alone would leave its rounding.
    along = cos_phi * across[0] + sin_phi * across[1]
    x = cos_h * along - sin_h * across[2]
    y = cos_phi * across[1] - sin_phi * across[0]
    z = 0.5 * (wh[0] * both[0] + wh[1] * both[1] + wh[2] * both[2])
    return wh, (x, y, z)


def _normalised(v: Components) -> Components:
    """As `safe_normalize`, of components."""
    x, y, z = v
    length = safe_sqrt(x * x + y * y + z * z)
    usable = length > 0
    divisor = jnp.where(usable, length, 1.0)
    return jnp.where(usable, x / divisor, 0.0), jnp.where(usable, y / divisor, 0.0), jnp.where(usable, z / divisor, 1.0)


def from_half_difference(wh: jax.Array, wd: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The pair (wi, wo) with half vector wh and difference vector wd; inverse of `half_difference`."""
    sin_h = safe_norm(wh[..., :2])
    cos_h = wh[..., 2]
    at_pole = sin_h == 0
    cos_phi = jnp.where(at_pole, 1.0, safe_divide(wh[..., 0], sin_h))
    sin_phi = safe_divide(wh[..., 1], sin_h)
    along = cos_h * wd[..., 0] + sin_h * wd[..., 2]
    x = cos_phi * along - sin_phi * wd[..., 1]
    y = sin_phi * along + cos_phi * wd[..., 1]
    z = cos_h * wd[..., 2] - sin_h * wd[..., 0]
    wi = jnp.stack([x, y, z], axis=-1)
    return wi, reflect(wi, wh)


def heading(w: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Cosine and sine of w's azimuth, `(...)` each; (1, 0) at the pole."""
    length = safe_norm(w[..., :2])
    cos_phi = jnp.where(length > 0, safe_divide(w[..., 0], length), 1.0)
    return cos_phi, safe_divide(w[..., 1], length)


def turn_to_azimuth_zero(wi: jax.Array, wo: jax.Array, pivot: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Both directions turned about the normal until `pivot` has azimuth zero: an isotropic query's canonical form."""
    cos_phi, sin_phi = heading(pivot)

    def turn(w: jax.Array) -> jax.Array:
        x = cos_phi * w[..., 0] + sin_phi * w[..., 1]
        y = cos_phi * w[..., 1] - sin_phi * w[..., 0]
        return jnp.stack([x, y, w[..., 2]], axis=-1)

    return turn(wi), turn(wo)


def sin_theta(w: jax.Array) -> jax.Array:
    """Sine between w and the normal, from the components that keep their precision near the pole."""
    return safe_sqrt(w[..., 0] ** 2 + w[..., 1] ** 2)


def tilt(w: jax.Array, n: jax.Array) -> jax.Array:
    """w under the shortest rotation that takes the normal to n, which must have n_z > -1.

    R w = (w_x + a n_x, w_y + a n_y, w_z n_z - n_x w_x - n_y w_y) with a = w_z - (n_x w_x + n_y w_y) / (1 + n_z):
    Rodrigues' formula about z x n, with 1 + n_z the only divisor.
    """
    across = n[..., 0] * w[..., 0] + n[..., 1] * w[..., 1]
    a = w[..., 2] - across / (1.0 + n[..., 2])
    return jnp.stack([w[..., 0] + a * n[..., 0], w[..., 1] + a * n[..., 1], w[..., 2] * n[..., 2] - across], axis=-1)


def untilt(w: jax.Array, n: jax.Array) -> jax.Array:
    """Inverse of `tilt`: w as it is seen in a frame whose normal is n."""
    return tilt(w, jnp.stack([-n[..., 0], -n[..., 1], n[..., 2]], axis=-1))
