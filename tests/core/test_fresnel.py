"""Fresnel's equations against complex arithmetic in float64 and against Mitsuba."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
import pytest

from jaxbrdf.core.fresnel import (
    Conductor,
    Dielectric,
    Schlick,
    conductor,
    dielectric,
    diffuse_reflectance,
    schlick,
)

pytestmark = pytest.mark.usefixtures("mitsuba_rgb")

COSINES = np.concatenate([[0.0, 1e-7, 1e-4, 1e-2], np.linspace(0.05, 1.0, 20)])
METALS = ((0.223, 3.204), (1.335, 1.872), (1.32, 7.307), (0.05, 4.0), (3.0, 3.0), (1.5, 1e-3), (1.5, 0.0), (0.02, 40.0))
INDICES = (1.0003, 1.33, 1.5, 2.4, 1 / 1.5, 0.9)


def complex_fresnel(cos: np.ndarray, index: complex) -> np.ndarray:
    """The textbook amplitudes in complex float64."""
    c = cos.astype(complex)
    q = np.sqrt(index**2 - 1 + c**2)
    s, p = (c - q) / (c + q), (index**2 * c - q) / (index**2 * c + q)
    return 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2)


@pytest.mark.parametrize(("eta", "k"), METALS)
def test_conductor_matches_complex_arithmetic_in_float32(eta: float, k: float):
    got = conductor(jnp.asarray(COSINES, jnp.float32), jnp.float32(eta), jnp.float32(k))
    want = complex_fresnel(COSINES.astype(np.float32).astype(float), complex(np.float32(eta), np.float32(k)))
    np.testing.assert_allclose(got, want, rtol=2e-6, atol=2e-7)


@pytest.mark.parametrize("eta", INDICES)
def test_dielectric_matches_complex_arithmetic_in_float32(eta: float):
    got = dielectric(jnp.asarray(COSINES, jnp.float32), jnp.float32(eta))
    want = complex_fresnel(COSINES.astype(np.float32).astype(float), complex(np.float32(eta)))
    # at eta = 1.0003 an index rounded to 6e-8 leaves g^2 uncertain by 1e-4 of itself at grazing angles
    np.testing.assert_allclose(got, want, rtol=2e-5, atol=1e-6)


@pytest.mark.parametrize("eta", INDICES)
def test_dielectric_matches_mitsuba(eta: float):
    want = [mi.fresnel(float(c), eta)[0] for c in COSINES]
    np.testing.assert_allclose(
        dielectric(jnp.asarray(COSINES, jnp.float32), jnp.float32(eta)), want, rtol=3e-4, atol=1e-6
    )


@pytest.mark.parametrize(("eta", "k"), METALS)
def test_conductor_matches_mitsuba(eta: float, k: float):
    want = [mi.fresnel_conductor(float(c), mi.Complex2f(eta, k)) for c in COSINES]
    got = conductor(jnp.asarray(COSINES, jnp.float32), jnp.float32(eta), jnp.float32(k))
    np.testing.assert_allclose(got, want, rtol=3e-4, atol=1e-6)


def test_total_reflection_is_total_and_has_no_gradient():
    value, slope = jax.value_and_grad(dielectric)(jnp.float32(0.1), jnp.float32(1 / 1.5))
    assert (value, slope) == (1.0, 0.0)


def test_no_interface_reflects_nothing():
    cos = jnp.array([1e-3, 0.5, 1.0])
    np.testing.assert_allclose(dielectric(cos, jnp.float32(1.0)), 0.0, atol=1e-12)
    np.testing.assert_allclose(conductor(cos, jnp.float32(1.0), jnp.float32(0.0)), 0.0, atol=1e-12)


def test_schlick_spans_f0_to_one():
    np.testing.assert_allclose(schlick(jnp.array([1.0, 0.5, 0.0]), jnp.array(0.04)), [0.04, 0.07, 1.0], rtol=1e-6)


@pytest.mark.parametrize("cos", [0.0, 1e-8, 0.5, 1.0])
@pytest.mark.parametrize("eta", [0.6, 1.0, 1.5])
def test_gradients_are_finite(cos: float, eta: float):
    slopes = jax.grad(dielectric, argnums=(0, 1))(jnp.float32(cos), jnp.float32(eta))
    slopes += jax.grad(conductor, argnums=(0, 1, 2))(jnp.float32(cos), jnp.float32(eta), jnp.float32(0.0))
    slopes += jax.grad(conductor, argnums=(0, 1, 2))(jnp.float32(cos), jnp.float32(eta), jnp.float32(3.0))
    assert np.all(np.isfinite(slopes))


@pytest.mark.parametrize("eta", [1.05, 1.33, 1.5, 3.0])
def test_diffuse_reflectance_matches_fine_quadrature(eta: float):
    cos = (np.arange(200_000) + 0.5) / 200_000
    want = np.mean(2 * cos * complex_fresnel(cos, complex(eta)))
    np.testing.assert_allclose(diffuse_reflectance(jnp.float32(eta)), want, rtol=3e-5)


def test_diffuse_reflectance_agrees_with_the_published_value():
    # Egan and Hilgeman's figure for index 1.5 from outside, quoted by Mitsuba's plastic
    np.testing.assert_allclose(diffuse_reflectance(jnp.float32(1.5)), 0.0918, atol=2e-4)


@pytest.mark.parametrize(
    "record",
    [
        Schlick(jnp.array([0.9, 0.5, 0.04])),
        Dielectric(jnp.array(1.5)),
        Conductor(jnp.array([0.2, 0.4, 1.3]), jnp.array([3.2, 2.5, 1.9])),
    ],
    ids=lambda r: type(r).__name__,
)
@pytest.mark.parametrize("shape", [(), (5,), (2, 3)])
def test_records_give_three_channels_for_any_batch(record, shape: tuple[int, ...]):
    reflectance = record.reflectance(jnp.full(shape, 0.7))
    assert reflectance.shape == (*shape, 3)
    np.testing.assert_allclose(
        reflectance, jnp.broadcast_to(record.reflectance(jnp.array(0.7)), (*shape, 3)), rtol=1e-6
    )
