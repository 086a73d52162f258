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
    SchlickF82,
    conductor,
    dielectric,
    diffuse_reflectance,
    schlick,
    schlick_f82,
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


EXTREME_COSINES = np.array([0.0, 1e-30, 1e-7, 1e-4, 1e-2, 0.1, 0.3, 0.55, 0.8, 0.99, 1 - 2**-23, 1.0])
EXTREME_INDICES = (1e-3, 0.01, 0.3, 0.69, 0.71, 0.95, 1 - 1e-6, 1.0, 1 + 1e-6, 1.0003, 1.5, 10.0, 1e3)


def extended_fresnel(cos: np.ndarray, eta: np.ndarray, k: np.ndarray) -> np.ndarray:
    """The textbook amplitudes in extended precision, from the same rounded arguments."""
    c, index = cos.astype(np.clongdouble), eta.astype(np.clongdouble) + 1j * k.astype(np.clongdouble)
    q = np.sqrt(index**2 - (1 - c) * (1 + c))
    with np.errstate(invalid="ignore"):
        s, p = (c - q) / (c + q), (index**2 * c - q) / (index**2 * c + q)
    there = np.abs(index - 1) > 0
    return np.where(there, 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2), 0.0).astype(float)


@pytest.mark.parametrize("extinction", [None, 0.0, 1e-6, 1e-3, 0.5, 1.0, 10.0, 1e3])
def test_extremes_in_float32(extinction: float | None):
    """Relative to the value, or to a reflectance of 1e-5 beside it."""
    k = extinction or 0.0
    cos, eta, k = (x.astype(np.float32).ravel() for x in np.meshgrid(EXTREME_COSINES, EXTREME_INDICES, [k]))
    got = jax.jit(dielectric)(cos, eta) if extinction is None else jax.jit(conductor)(cos, eta, k)
    want = extended_fresnel(cos, eta, k)
    error = np.abs(got - want) / (want + 1e-5)
    assert error.max() < 1e-5, (cos[error.argmax()], eta[error.argmax()])
    assert np.all((np.asarray(got) >= 0) & (np.asarray(got) <= 1 + 2e-7))


@pytest.mark.parametrize("law", [dielectric, conductor])
def test_gradients_at_extremes(law):
    cos, eta, k = (x.astype(np.float32).ravel() for x in np.meshgrid(EXTREME_COSINES, EXTREME_INDICES, [0, 1e-3, 1e3]))
    arguments = (cos, eta, k)[: 2 if law is dielectric else 3]
    slopes = jax.jit(jax.vmap(jax.grad(law, argnums=tuple(range(len(arguments))))))(*arguments)
    assert np.all(np.isfinite(slopes))


def test_f82_passes_through_its_points():
    f0, tint, cos = jnp.array([0.9, 0.5, 0.04]), jnp.array([0.6, 1.0, 0.3]), jnp.array([0.0, 1 / 7, 1.0])
    got = SchlickF82(f0, tint).reflectance(cos)
    np.testing.assert_allclose(got[0], 1.0, rtol=1e-6)
    np.testing.assert_allclose(got[1], tint * schlick(cos[1], f0), rtol=1e-5)
    np.testing.assert_allclose(got[2], f0, rtol=1e-6)


def test_f82_stays_in_range_and_with_tint_one_is_schlick():
    cos, f0, tint = (jnp.asarray(x.ravel(), jnp.float32) for x in np.meshgrid(*[np.linspace(0, 1, 41)] * 3))
    got = schlick_f82(cos, f0, tint)
    assert np.all((np.asarray(got) >= 0) & (np.asarray(got) <= 1 + 1e-6))
    np.testing.assert_allclose(schlick_f82(cos, f0, jnp.ones_like(f0)), schlick(cos, f0), rtol=1e-6)


@pytest.mark.parametrize(("eta", "k"), [(1.0, 6.5), (3.1, 3.3), (2.9, 2.9)])
def test_f82_is_nearer_to_metals_than_schlick(eta: float, k: float):
    cos = jnp.asarray(np.linspace(0.0, 1.0, 101), jnp.float32)
    want = complex_fresnel(np.asarray(cos, float), complex(eta, k))
    f0 = jnp.float32(want[-1])
    low = jnp.float32(complex_fresnel(np.array([1 / 7]), complex(eta, k))[0])
    tint = low / schlick(jnp.float32(1 / 7), f0)
    f82_error = np.abs(schlick_f82(cos, f0, tint) - want).max()
    assert f82_error < 0.5 * np.abs(schlick(cos, f0) - want).max()


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
        SchlickF82(jnp.array([0.9, 0.5, 0.04]), jnp.array([0.5, 0.7, 1.0])),
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
