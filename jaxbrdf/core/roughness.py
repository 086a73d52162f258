"""Roughness of a microsurface: a symmetric positive matrix A on the tangent plane, in the forms that people give it.

A has the roughness alpha along each of its axes as eigenvalue, so a microfacet slope is A times a slope of unit
roughness. Each form is a record whose type says what it knows: `Isotropic` needs one multiplication where `Tensor`
needs four and a determinant. Fields are `()` or of the directions' batch shape.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.numerics import difference_of_products, safe_sqrt
from jaxbrdf.core.ranges import ANY, Range

ROUGHNESS = Range(1e-4, 1.0)
"""Of alpha: a lobe of 1e-4 is a mirror to every film, and its peak, 1 / (pi alpha^2) = 3e7, is far from overflow."""

LEAST_FILTERED = 0.045**2
"""alpha of a perceptual roughness of 0.045, the least that Gauthier et al. (2022, section 3.1) let a texture have."""


class Roughness(Protocol):
    """What a distribution of normals needs of its roughness."""

    def stretch(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        """A (x, y)."""
        ...

    def shrink(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        """A^-1 (x, y)."""
        ...

    def determinant(self) -> jax.Array:
        """det A, the product of both axes' roughness."""
        ...

    def tensor(self) -> Tensor:
        """A itself."""
        ...


class Isotropic(NamedTuple):
    """alpha: the same in every direction."""

    alpha: Annotated[jax.Array, ROUGHNESS]

    def stretch(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        return self.alpha * x, self.alpha * y

    def shrink(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        return x / self.alpha, y / self.alpha

    def determinant(self) -> jax.Array:
        return self.alpha * self.alpha

    def tensor(self) -> Tensor:
        return Tensor(self.alpha, self.alpha, jnp.zeros_like(self.alpha))


class Axes(NamedTuple):
    """alpha_x, alpha_y: along tangent and bitangent."""

    alpha_x: Annotated[jax.Array, ROUGHNESS]
    alpha_y: Annotated[jax.Array, ROUGHNESS]

    def stretch(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        return self.alpha_x * x, self.alpha_y * y

    def shrink(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        return x / self.alpha_x, y / self.alpha_y

    def determinant(self) -> jax.Array:
        return self.alpha_x * self.alpha_y

    def tensor(self) -> Tensor:
        return Tensor(self.alpha_x, self.alpha_y, jnp.zeros_like(self.alpha_x * self.alpha_y))


class Turned(NamedTuple):
    """alpha_x, alpha_y along axes that are turned by `angle` (radians) about the normal, from tangent to bitangent."""

    alpha_x: Annotated[jax.Array, ROUGHNESS]
    alpha_y: Annotated[jax.Array, ROUGHNESS]
    angle: Annotated[jax.Array, ANY]

    def stretch(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        along, across = _turn(x, y, -self.angle)
        return _turn(self.alpha_x * along, self.alpha_y * across, self.angle)

    def shrink(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        along, across = _turn(x, y, -self.angle)
        return _turn(along / self.alpha_x, across / self.alpha_y, self.angle)

    def determinant(self) -> jax.Array:
        return self.alpha_x * self.alpha_y

    def tensor(self) -> Tensor:
        c, s = jnp.cos(self.angle), jnp.sin(self.angle)
        a = self.alpha_x * c * c + self.alpha_y * s * s
        b = self.alpha_x * s * s + self.alpha_y * c * c
        return Tensor(a, b, (self.alpha_x - self.alpha_y) * c * s)


class InFrame(NamedTuple):
    """Q A Q^T: another roughness in a frame that is turned about the normal, by the cosine and sine of its angle.

    Without that product's entries, which cancel where A is thin.
    """

    roughness: Roughness
    cos: jax.Array
    sin: jax.Array

    def stretch(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        return self._out(*self.roughness.stretch(*self._into(x, y)))

    def shrink(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        return self._out(*self.roughness.shrink(*self._into(x, y)))

    def determinant(self) -> jax.Array:
        return self.roughness.determinant()

    def tensor(self) -> Tensor:
        one, none = jnp.ones_like(self.cos), jnp.zeros_like(self.cos)
        a, c = self.stretch(one, none)
        return Tensor(a, self.stretch(none, one)[1], c)

    def _into(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        return self.cos * x + self.sin * y, self.cos * y - self.sin * x

    def _out(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        return self.cos * x - self.sin * y, self.cos * y + self.sin * x


class Tensor(NamedTuple):
    """A = [[a, c], [c, b]] (Gauthier et al. 2022, Eq. 1), the form whose averages are roughness too.

    a is the roughness along the tangent and b that along the bitangent: the paper's a and b, which its appendix pairs
    with the other axis each, are swapped, and c has the opposite sign.
    """

    a: Annotated[jax.Array, ROUGHNESS]
    b: Annotated[jax.Array, ROUGHNESS]
    c: Annotated[jax.Array, ANY]

    def stretch(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        # to the last bit also where a thin ellipse makes the two terms cancel
        return difference_of_products(self.a, x, -self.c, y), difference_of_products(self.b, y, -self.c, x)

    def shrink(self, x: jax.Array, y: jax.Array) -> tuple[jax.Array, jax.Array]:
        determinant = self.determinant()
        along = difference_of_products(self.b, x, self.c, y) / determinant
        return along, difference_of_products(self.a, y, self.c, x) / determinant

    def determinant(self) -> jax.Array:
        return difference_of_products(self.a, self.b, self.c, self.c)

    def tensor(self) -> Tensor:
        return self

    def fault(self) -> str | None:
        """What is wrong with the entries together, or None."""
        a, b, c = (np.asarray(entry, np.float64) for entry in self)
        middle, half = 0.5 * (a + b), np.hypot(0.5 * (a - b), c)
        # float32 entries of a valid matrix are off by half a unit in the last place each, and so are its eigenvalues
        slack = 4 * np.finfo(np.float32).eps
        bad = (middle - half < ROUGHNESS.low - slack) | (middle + half > ROUGHNESS.high + slack)
        if not bad.any():
            return None
        at = np.flatnonzero(bad.ravel())[0]
        low, high = ((middle + sign * half).ravel()[at] for sign in (-1, 1))
        return f"has eigenvalues {low:g} and {high:g}; both must be from {ROUGHNESS.low:g} to {ROUGHNESS.high:g}"

    def nearest_valid(self) -> Tensor:
        """`project_tensor` at the least roughness."""
        return project_tensor(self)


def project_tensor(tensor: Tensor, *, least: float = ROUGHNESS.low) -> Tensor:
    """A tensor with both eigenvalues in [least, 1], by clamping a and b, then c (Gauthier et al. 2022, Eqs. 3 to 5).

    It keeps valid tensors as they are.

    Args:
        tensor: any entries.
        least: alpha; `LEAST_FILTERED` is the paper's.
    """
    a, b = (jnp.where(x < least, jnp.asarray(least, x.dtype), jnp.where(x > 1.0, 1.0, x)) for x in tensor[:2])
    bound = largest_c(a, b, least=least)
    c = jnp.where(tensor.c > bound, bound, jnp.where(tensor.c < -bound, -bound, tensor.c))
    return Tensor(a, b, c)


def largest_c(a: jax.Array, b: jax.Array, *, least: float = ROUGHNESS.low) -> jax.Array:
    """|c| up to which both eigenvalues are in [least, 1], for a and b there (Gauthier et al. 2022, Eq. 5).

    Of the three bounds in Eq. 5 the first, a b - least^2, is never the smallest: it exceeds (a - least)(b - least) by
    least (a + b - 2 least).
    """
    return safe_sqrt(jnp.minimum((1.0 - a) * (1.0 - b), (a - least) * (b - least)))


def principal_axes(tensor: Tensor) -> Turned:
    """The eigenvalues, larger first, and the angle of the larger one's axis in (-pi / 2, pi / 2]; zero if equal."""
    half_difference = 0.5 * (tensor.a - tensor.b)
    half = jnp.hypot(half_difference, tensor.c)
    largest = 0.5 * (tensor.a + tensor.b) + half
    at_circle = half == 0
    angle = 0.5 * jnp.arctan2(tensor.c, jnp.where(at_circle, 1.0, half_difference))
    # the smaller by the product of both, which does not cancel
    return Turned(largest, tensor.determinant() / largest, jnp.where(at_circle, 0.0, angle))


def _turn(x: jax.Array, y: jax.Array, angle: jax.Array) -> tuple[jax.Array, jax.Array]:
    c, s = jnp.cos(angle), jnp.sin(angle)
    return c * x - s * y, s * x + c * y
