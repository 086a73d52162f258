"""Roughness in its five forms: the same matrix, valid after projection, exact to the last digits where it is thin."""

from __future__ import annotations

from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jax.test_util import check_grads

from jaxbrdf.core.numerics import difference_of_products
from jaxbrdf.core.roughness import (
    LEAST_FILTERED,
    Axes,
    InFrame,
    Isotropic,
    Roughness,
    Tensor,
    Turned,
    principal_axes,
    project_tensor,
)

FORMS = {
    "isotropic": (Isotropic(jnp.array(0.3)), [[0.3, 0.0], [0.0, 0.3]]),
    "axes": (Axes(jnp.array(0.2), jnp.array(0.7)), [[0.2, 0.0], [0.0, 0.7]]),
    # cos = 0.6, sin = 0.8: the eigenvectors are rational
    "turned": (Turned(jnp.array(0.5), jnp.array(0.1), jnp.arctan2(0.8, 0.6)), [[0.244, 0.192], [0.192, 0.356]]),
    "in a frame": (
        InFrame(Axes(jnp.array(0.5), jnp.array(0.1)), jnp.array(0.6), jnp.array(0.8)),
        [[0.244, 0.192], [0.192, 0.356]],
    ),
    "tensor": (Tensor(jnp.array(0.5), jnp.array(0.3), jnp.array(-0.2)), [[0.5, -0.2], [-0.2, 0.3]]),
}
PROJECT = jax.jit(project_tensor, static_argnames="least")
ALPHA = st.floats(1e-4, 1.0)
ANGLE = st.floats(-10.0, 10.0, allow_subnormal=False)
ENTRY = st.floats(-3.0, 3.0, allow_subnormal=False)


def entries(tensor: Tensor) -> np.ndarray:
    a, b, c = (np.asarray(x, float) for x in tensor)
    return np.array([[a, c], [c, b]])


def tensor_of(*values: float) -> Tensor:
    return Tensor(*(jnp.float32(v) for v in values))


def turned_entries(alpha_x: float, alpha_y: float, angle: float) -> tuple[float, float, float]:
    c, s = np.cos(angle), np.sin(angle)
    return alpha_x * c * c + alpha_y * s * s, alpha_x * s * s + alpha_y * c * c, (alpha_x - alpha_y) * c * s


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_its_matrix(form: str):
    roughness, matrix = FORMS[form]
    v = np.random.default_rng(0).normal(size=(50, 2))
    x, y = jnp.asarray(v[:, 0], jnp.float32), jnp.asarray(v[:, 1], jnp.float32)
    np.testing.assert_allclose(jnp.stack(roughness.stretch(x, y), -1), v @ np.array(matrix), rtol=1e-5, atol=1e-6)
    inverse = v @ np.linalg.inv(matrix)
    np.testing.assert_allclose(jnp.stack(roughness.shrink(x, y), -1), inverse, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(roughness.determinant(), np.linalg.det(matrix), rtol=1e-6)
    np.testing.assert_allclose(entries(roughness.tensor()), matrix, atol=1e-7)


@given(st.tuples(ENTRY, ENTRY, ENTRY), st.sampled_from([1e-4, LEAST_FILTERED]))
def test_projection_is_valid_and_final(values: tuple[float, float, float], least: float):
    projected = PROJECT(tensor_of(*values), least=least)
    low, high = np.linalg.eigvalsh(entries(projected))
    # half a unit in the last place of entries near one
    assert low >= least - 1.2e-7
    assert high <= 1.0 + 1.2e-7
    again = PROJECT(projected, least=least)
    np.testing.assert_array_equal(np.stack(again), np.stack(projected))


@given(ALPHA, ALPHA, ANGLE)
def test_projection_keeps_what_is_valid(alpha_x: float, alpha_y: float, angle: float):
    tensor = tensor_of(*turned_entries(alpha_x, alpha_y, angle))
    # c of an ellipse that touches the ends is bounded by the root of a difference that is rounded
    np.testing.assert_allclose(np.stack(PROJECT(tensor)), np.stack(tensor), atol=3e-7)


def test_projection_is_the_identity_within():
    tensor = tensor_of(0.5, 0.3, -0.2)
    np.testing.assert_array_equal(np.stack(PROJECT(tensor)), np.stack(tensor))
    jacobian = jax.jacobian(lambda v: jnp.stack(project_tensor(Tensor(*v))))(jnp.stack(tensor))
    np.testing.assert_array_equal(jacobian, np.eye(3))


def test_projection_has_finite_gradients_everywhere():
    values = np.array(np.meshgrid(*[[-1.0, 0.0, 1e-4, 0.3, 1.0, 2.0]] * 3)).reshape(3, -1).T
    jacobian = jax.vmap(jax.jacobian(lambda v: jnp.stack(project_tensor(Tensor(*v)))))(jnp.asarray(values, jnp.float32))
    assert np.all(np.isfinite(jacobian))


@given(ALPHA, ALPHA, ANGLE)
def test_principal_axes_give_the_tensor_back(alpha_x: float, alpha_y: float, angle: float):
    tensor = tensor_of(*turned_entries(alpha_x, alpha_y, angle))
    axes = principal_axes(tensor)
    assert float(axes.alpha_x) >= float(axes.alpha_y) - 1e-7
    assert -np.pi / 2 < float(axes.angle) <= np.pi / 2 + 1e-6
    np.testing.assert_allclose(entries(axes.tensor()), entries(tensor), atol=4e-7)
    eigenvalues = np.linalg.eigvalsh(entries(tensor))
    np.testing.assert_allclose([axes.alpha_y, axes.alpha_x], eigenvalues, rtol=5e-6)


def test_principal_axes_of_a_circle():
    axes, gradient = jax.vmap(jax.value_and_grad(lambda v: sum(principal_axes(Tensor(*v)))))(
        jnp.array([[0.3, 0.3, 0.0], [1e-4, 1e-4, 0.0], [0.3, 0.2, 0.0]])
    )
    np.testing.assert_allclose(axes, [0.6, 2e-4, 0.5], rtol=1e-6)
    assert np.all(np.isfinite(gradient))


def thin_tensors() -> tuple[Tensor, np.ndarray]:
    """Ellipses of 1e-4:1 as float32 can have them, and the same numbers in 80 bits."""
    angle = np.random.default_rng(1).uniform(-np.pi, np.pi, 4000)
    rounded = [np.float32(x) for x in turned_entries(1.0, 1e-4, angle)]
    valid = rounded[0].astype(float) * rounded[1] - rounded[2].astype(float) ** 2 > 5e-5
    kept = [x[valid] for x in rounded]
    return Tensor(*map(jnp.asarray, kept)), np.stack(kept).astype(np.longdouble)


def test_thin_tensors_keep_their_digits():
    tensor, (a, b, c) = thin_tensors()
    assert len(a) > 1000
    v = np.random.default_rng(2).normal(size=(2, len(a))).astype(np.float32)
    # half of the vectors along the thin axis, where stretching cancels
    v[:, ::2] = np.stack([-c[::2], a[::2]])
    x, y = v.astype(np.longdouble)
    determinant = a * b - c * c
    np.testing.assert_allclose(jax.jit(Tensor.determinant)(tensor), determinant.astype(float), rtol=3e-7)
    stretched = jax.jit(Tensor.stretch)(tensor, *jnp.asarray(v))
    np.testing.assert_allclose(stretched[0], (a * x + c * y).astype(float), rtol=3e-7)
    np.testing.assert_allclose(stretched[1], (c * x + b * y).astype(float), rtol=3e-7)
    shrunk = jax.jit(Tensor.shrink)(tensor, *jnp.asarray(v))
    np.testing.assert_allclose(shrunk[0], ((b * x - c * y) / determinant).astype(float), rtol=6e-7)
    np.testing.assert_allclose(shrunk[1], ((a * y - c * x) / determinant).astype(float), rtol=6e-7)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_differences_of_products_are_exact_to_two_units(dtype: type):
    rng = np.random.default_rng(3)
    a, b, c = (rng.uniform(0.5, 2.0, (3, 20_000)) * 10.0 ** rng.integers(-8, 8, 20_000)).astype(dtype)
    # d so that the products agree to all but their last digits
    d = (a.astype(float) * b / c * (1 + rng.integers(-3, 4, 20_000) * float(np.finfo(dtype).eps))).astype(dtype)
    with jax.enable_x64(dtype is np.float64):
        got = np.asarray(jax.jit(difference_of_products)(*map(jnp.asarray, (a, b, c, d))))
        want = np.array([float(exact_difference(*map(float, q))) for q in zip(a, b, c, d, strict=True)])
    np.testing.assert_allclose(got, want, rtol=2 * np.finfo(dtype).eps, atol=0)


def exact_difference(a: float, b: float, c: float, d: float) -> Fraction:
    return Fraction(a) * Fraction(b) - Fraction(c) * Fraction(d)


@pytest.mark.parametrize("form", FORMS)
def test_gradients_match_finite_differences(form: str):
    def all_of(roughness: Roughness, x: jax.Array, y: jax.Array) -> tuple:
        return roughness.stretch(x, y), roughness.shrink(x, y), roughness.determinant(), tuple(roughness.tensor())

    with jax.enable_x64(True):
        roughness = jax.tree.map(lambda x: jnp.asarray(np.asarray(x), jnp.float64), FORMS[form][0])
        check_grads(
            all_of, (roughness, jnp.array([0.3, -2.0]), jnp.array([1.0, 0.1])), order=1, modes=["rev"], rtol=1e-6
        )
