"""Thin films against characteristic matrices, textbook coatings, energy, and each wavelength on its own."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.fresnel import Conductor, dielectric
from jaxbrdf.core.ranges import check_ranges, clamp
from jaxbrdf.core.thin_film import POLES, ThinFilm, airy_reflectance, film_reflectance, integrated_reflectance
from jaxbrdf.data.spectrum import VISIBLE, visible_response

AIRY, FILM = jax.jit(airy_reflectance), jax.jit(film_reflectance)
INTEGRATED = jax.jit(integrated_reflectance)
RECORD = jax.jit(ThinFilm.reflectance)
RESPONSE = (jnp.asarray(VISIBLE, jnp.float32), jnp.asarray(visible_response(), jnp.float32))
BASES = (1.0, 1.5, 2.4, 0.7, 0.2 + 3.3j, 1.0 + 6.5j, 3.0 + 3.3j, 13.0 + 4.0j)


def grid(*axes) -> list[np.ndarray]:
    return [x.astype(np.float32).ravel() for x in np.meshgrid(*axes, indexing="ij")]


def matrix_coefficients(cos, wavelength, thickness, eta, base: complex) -> np.ndarray:
    """R and T of a layer by its 2x2 characteristic matrix, unpolarised (Born and Wolf, 1.6.2), `(2, ...)`."""
    outside, film, below = (np.sqrt(n**2 - 1 + cos**2 + 0j) for n in (1.0, eta, base))
    beta = 2 * np.pi / wavelength * thickness * film
    total = np.zeros((2, *cos.shape))
    for power in (0, 2):
        first, layer, last = outside, film / eta**power, below / base**power
        e = np.cos(beta) - 1j * np.sin(beta) / layer * last
        h = np.cos(beta) * last - 1j * np.sin(beta) * layer
        total += 0.5 * np.stack(
            [np.abs((first * e - h) / (first * e + h)) ** 2, 4 * first.real * last.real / np.abs(first * e + h) ** 2]
        )
    return total


@pytest.mark.parametrize("absorbing", [False, True])
def test_airy_matches_characteristic_matrices(absorbing: bool):
    rng = np.random.default_rng(0)
    low, high = np.array([[0.0, 400, 0, 1.0, 0.1, 0.0], [1.0, 700, 2000, 3.0, 4.0, 6.0]])
    cos, wavelength, thickness, eta, n, k = (low + (high - low) * rng.random((4000, 6))).astype(np.float32).T
    k = k * absorbing
    got = AIRY(cos, wavelength, thickness, eta, n, k)
    want = matrix_coefficients(*(x.astype(float) for x in (cos, wavelength, thickness, eta)), n + 1j * k.astype(float))
    # 2 pi D / l reaches 200, which float32 has within 2e-5
    np.testing.assert_allclose(got, want[0], rtol=0, atol=5e-5)
    if not absorbing:
        np.testing.assert_allclose(1.0 - np.asarray(got), want[1], rtol=0, atol=5e-5)


def test_a_quarter_wave_of_the_root_of_the_index_does_not_reflect():
    base = 2.25
    for order in (1, 3, 5):
        thickness = jnp.float32(order * 550.0 / (4.0 * np.sqrt(base)))
        got = AIRY(jnp.float32(1), jnp.float32(550), thickness, jnp.float32(np.sqrt(base)), jnp.float32(base), 0.0)
        assert abs(got) < 1e-6
    half = jnp.float32(550.0 / (2.0 * np.sqrt(base)))
    got = AIRY(jnp.float32(1), jnp.float32(550), half, jnp.float32(np.sqrt(base)), jnp.float32(base), 0.0)
    np.testing.assert_allclose(got, ((base - 1) / (base + 1)) ** 2, rtol=1e-5)


@pytest.mark.parametrize("base", BASES)
def test_closed_form_against_every_wavelength(base: complex):
    """The errors that the module states."""
    cos, thickness, eta = grid(
        [0.0, 1e-4, 0.02, 0.1, 0.3, 0.6, 1.0], np.arange(0.0, 2001.0, 40.0), [1.2, 1.33, 1.5, 1.75, 2.0]
    )
    n, k = np.float32(np.real(base)), np.float32(np.imag(base))
    want = INTEGRATED(cos, thickness, eta, (jnp.full(VISIBLE.shape, n), jnp.full(VISIBLE.shape, k)), RESPONSE)
    got = FILM(cos[:, None], thickness[:, None], eta[:, None], jnp.full((1, 3), n), jnp.full((1, 3), k))
    # nearer to grazing the resonances of a film in air are narrower than the observer's samples, a nanometre apart
    error = np.abs(np.asarray(got) - np.asarray(want))[(cos >= 0.02) | (cos == 0)]
    assert error.max() < (0.008 if base == 1.0 else 0.004)
    assert np.sqrt(np.mean(error**2)) < 6e-4
    bare = Conductor(jnp.full(3, n), jnp.full(3, k)).reflectance(jnp.asarray(cos))
    np.testing.assert_allclose(got[thickness == 0], bare[thickness == 0], rtol=0, atol=2e-6)


def test_poles_are_the_transform_of_the_response():
    """Largest distance of 0.0095, and none at zero."""
    paths = np.arange(0.0, 12000.0, 13.0)
    want = np.exp(2j * np.pi * paths[:, None] / VISIBLE) @ visible_response()
    decay, turn, real, imaginary = np.moveaxis(POLES, -1, 0)
    got = np.exp(paths[:, None, None] * (1j * turn - decay)) * (real + 1j * imaginary)
    assert np.abs(got.sum(axis=-1) - want).max() < 0.0095
    assert np.abs(got.sum(axis=-1)[0] - 1.0).max() < 1e-8


def test_a_thick_film_is_its_mean_over_the_phase():
    """Every phase alike: what is left is the sum of intensities, as for a slab."""
    cos, eta, n = jnp.float32(0.7), jnp.float32(1.6), jnp.float32(2.2)
    phases = jnp.asarray(np.arange(256) / 256, jnp.float32)
    period = 500.0 / (2.0 * np.sqrt(1.6**2 - 1 + 0.49))
    mean = jnp.mean(AIRY(cos, jnp.float32(500), phases * period, eta, n, 0.0))
    got = FILM(cos[None], jnp.full(1, 1e5), eta[None], jnp.full(3, n), jnp.zeros(3))
    np.testing.assert_allclose(got, mean, rtol=1e-4)


def test_a_film_of_index_one_is_absent_and_one_of_the_base_is_the_base():
    cos = jnp.asarray(np.linspace(0.0, 1.0, 33), jnp.float32)
    base = Conductor(jnp.array([1.5, 2.0, 0.8]), jnp.zeros(3))
    thin = ThinFilm(jnp.array(350.0), jnp.array(1.0), base)
    np.testing.assert_allclose(RECORD(thin, cos), base.reflectance(cos), rtol=0, atol=3e-6)
    same = ThinFilm(jnp.array(350.0), jnp.array(1.5), Conductor(jnp.full(3, 1.5), jnp.zeros(3)))
    np.testing.assert_allclose(RECORD(same, cos)[:, 0], dielectric(cos, jnp.float32(1.5)), rtol=0, atol=3e-6)


def test_total_reflection_below_the_film_is_total():
    base = Conductor(jnp.full(3, 0.7), jnp.zeros(3))
    got = RECORD(ThinFilm(jnp.array(400.0), jnp.array(1.4), base), jnp.array([0.0, 1e-7, 0.2, 0.6]))
    np.testing.assert_array_equal(got, 1.0)


@pytest.mark.parametrize("shape", [(), (2, 3)])
def test_record_gives_three_channels_in_range_for_any_batch(shape: tuple[int, ...]):
    base = Conductor(jnp.array([0.2, 0.4, 1.3]), jnp.array([3.2, 2.5, 1.9]))
    film = ThinFilm(jnp.full(shape, 1500.0), jnp.full(shape, 2.0), base)
    check_ranges(film)
    got = RECORD(film, jnp.full(shape, 0.7))
    assert got.shape == (*shape, 3)
    assert np.all((np.asarray(got) >= 0) & (np.asarray(got) <= 1))


def test_what_is_out_of_range_is_refused_or_clamped():
    film = ThinFilm(jnp.array(-1.0), jnp.array(1.5), Conductor(jnp.full(3, 1.5), jnp.zeros(3)))
    with pytest.raises(ValueError, match="thickness is -1"):
        check_ranges(film)
    assert clamp(film).thickness == 0.0


def test_value_and_gradient_are_finite_at_extremes():
    arguments = grid(
        [0.0, 1e-30, 1e-7, 0.5, 1.0], [0.0, 1e-30, 1e-3, 300.0, 1e6], [1.0, 1 + 1e-6, 1.5, 10.0],
        [1e-3, 0.7, 1.0, 1.5, 1e3], [0.0, 1e-3, 3.0, 1e3],
    )  # fmt: skip

    def total(cos, thickness, eta, n, k):
        return jnp.sum(film_reflectance(cos[None], thickness[None], eta[None], jnp.full(3, n), jnp.full(3, k)))

    values, slopes = jax.jit(jax.vmap(jax.value_and_grad(total, argnums=(0, 1, 2, 3, 4))))(*arguments)
    for name, numbers in zip(("value", "cos", "thickness", "eta", "n", "k"), (values, *slopes), strict=True):
        wrong = ~np.isfinite(numbers)
        assert not wrong.any(), (name, [a[wrong][0] for a in arguments])


def test_gradients_are_those_of_finite_differences():
    """Derivatives in float32 against central differences in float64."""
    point = np.array([0.6, 420.0, 1.4, 1.8, 0.3])
    steps = np.array([1e-4, 0.05, 1e-4, 1e-4, 1e-4])

    def total(x):
        return jnp.sum(film_reflectance(x[:1], x[1:2], x[2:3], jnp.full(3, x[3]), jnp.full(3, x[4])))

    got = jax.jit(jax.grad(total))(jnp.asarray(point, jnp.float32))
    with jax.enable_x64(True):
        value = jax.jit(total)
        want = [(value(point + s) - value(point - s)) / (2 * s.sum()) for s in np.diag(steps)]
    np.testing.assert_allclose(got, np.array(want), rtol=1e-3)
