"""The phase function's normalisation and mean, its draws, and flights against Beer's law."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.medium import Medium, fly, phase, sample_phase, transmittance

WO = jnp.array([0.48, 0.6, -0.64])


@pytest.mark.parametrize("g", [-0.99, -0.5, 0.0, 1e-4, 0.7, 0.99])
def test_phase_function(g: float):
    medium = Medium(asymmetry=jnp.array(g))
    # along the axis the density is a function of the cosine; mu = 1 - 2 t^4 crowds the nodes forwards, and backwards
    t, weights = np.polynomial.legendre.leggauss(200)
    t, weights = 0.5 * (t + 1), 0.5 * weights
    mu = 1 - 2 * t**4 if g > 0 else 2 * t**4 - 1
    wi = jnp.asarray(np.stack([np.sqrt(1 - mu**2), 0 * mu, -mu], -1), jnp.float32)
    density = np.asarray(phase(medium, wi, jnp.broadcast_to(jnp.array([0.0, 0.0, 1.0]), wi.shape)), float)
    mass = 2 * np.pi * density * 8 * t**3 * weights
    np.testing.assert_allclose(mass.sum(), 1.0, rtol=1e-3)
    np.testing.assert_allclose((mass * mu).sum(), g, atol=1e-3)


@pytest.mark.parametrize("g", [None, -0.5, 1e-4, 0.9])
def test_scattered_directions(g: float | None):
    medium = Medium(asymmetry=None if g is None else jnp.array(g))
    wo = jnp.broadcast_to(WO, (200_000, 3))
    wi = sample_phase(medium, wo, jax.random.uniform(jax.random.key(0), (2, 200_000)))
    np.testing.assert_allclose(np.linalg.norm(wi, axis=-1), 1.0, atol=1e-6)
    # the mean direction is g times straight on, and moments of the density are those of the draws
    np.testing.assert_allclose(np.mean(wi, axis=0), -(g or 0.0) * np.asarray(WO), atol=5e-3)
    uniform = np.random.default_rng(1).normal(size=(200_000, 3))
    uniform = jnp.asarray(uniform / np.linalg.norm(uniform, axis=-1, keepdims=True), jnp.float32)
    square = 4 * np.pi * np.asarray(phase(medium, uniform, wo)) * np.square(uniform @ WO)
    drawn = np.square(wi @ WO)
    error = np.hypot(square.std(), drawn.std()) / np.sqrt(200_000)
    assert abs(square.mean() - drawn.mean()) < 4 * error


@pytest.mark.parametrize("scattering", [(0.5, 1.0, 2.0), (0.0, 0.0, 3.0), (0.0, 0.0, 0.0)])
def test_flights_carry_beers_law(scattering: tuple[float, float, float]):
    medium = Medium(jnp.array([0.3, 0.1, 0.0]), jnp.array(scattering))
    w, depth = jnp.broadcast_to(WO, (200_000, 3)), jnp.full(200_000, 0.25)
    flight = fly(medium, depth, w, jax.random.uniform(jax.random.key(2), (2, 200_000)))
    kept = np.asarray(flight.kept, float)
    arrived = np.where(np.asarray(flight.scattered)[:, None], 0.0, kept)
    want = transmittance(medium, jnp.array(0.75), WO)
    total = np.add(scattering, (0.3, 0.1, 0.0))
    np.testing.assert_allclose(want, np.exp(-total * 0.75 / 0.64), rtol=1e-6)
    assert np.all(np.abs(arrived.mean(0) - want) <= 4 * arrived.std(0) / np.sqrt(200_000) + 1e-6)
    # what scatters on the way: the rest, less what is absorbed
    scattered = np.where(np.asarray(flight.scattered)[:, None], kept, 0.0)
    share = np.divide(scattering, total, out=np.zeros(3), where=total > 0) * (1 - np.asarray(want))
    assert np.all(np.abs(scattered.mean(0) - share) <= 4 * scattered.std(0) / np.sqrt(200_000) + 1e-6)
    assert np.all(kept <= 3 + 1e-5)
