"""Beckmann: quadrature over slopes, Mitsuba's microfacet distribution, scipy's erfc, draws against their density."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
import pytest
from scipy.special import erfc

from jaxbrdf.checks.chi_square import significance_of_each
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.roughness import Axes, Isotropic
from jaxbrdf.core.smith import lift
from tests.core.facets import CASES, VIEWS, directions, facets, in_double, slope_of, visible_chi_square

DENSITY, AREA, SAMPLE = jax.jit(Beckmann.density), jax.jit(Beckmann.projected_area), jax.jit(Beckmann.sample_visible)


def beckmann(name: str) -> Beckmann:
    return Beckmann(CASES[name].roughness, slope_of(CASES[name]))


@pytest.mark.parametrize("name", CASES)
def test_density_and_projected_area_are_those_of_the_slopes(name: str):
    grid = facets(CASES[name], 800)
    views = np.asarray(spherical(*jnp.array(VIEWS).T), float)
    with jax.enable_x64(True):
        density = np.asarray(DENSITY(in_double(beckmann(name)), jnp.asarray(grid.wh)))
        area = np.asarray(AREA(in_double(beckmann(name)), jnp.asarray(views)))
    weight = density * grid.wh[:, 2] ** 3 * grid.area
    np.testing.assert_allclose(np.sum(weight * grid.wh[:, 2]), 1.0, rtol=1e-4)
    want = [np.sum(weight * np.maximum(grid.wh @ w, 0.0)) for w in views]
    np.testing.assert_allclose(area, want, rtol=1e-4, atol=1e-7)
    assert np.all(area >= 0)


@pytest.mark.parametrize("alpha", [(1e-3, 0.1), (0.05, 0.4), (0.3, 0.3), (1.0, 0.6)], ids=str)
def test_terms_match_mitsuba(mitsuba_rgb, alpha: tuple[float, float]):
    reference = mi.MicrofacetDistribution(mi.MicrofacetType.Beckmann, *alpha, True)
    w, wh = directions(300, 0), np.concatenate([directions(100, 1), facets_near(alpha)])
    facing = np.sum(w * wh, -1) > 0
    ours = Beckmann(Axes(*map(jnp.float32, alpha)))
    density = np.asarray(DENSITY(ours, jnp.asarray(wh)))
    # the exponent, up to 87, is rounded
    np.testing.assert_allclose(density, [reference.eval(h) for h in wh.tolist()], rtol=1e-4, atol=1e-18)
    pairs = zip(w.tolist(), wh.tolist(), strict=True)
    masking = np.array([reference.smith_g1(*pair) for pair in pairs])
    exact = w[:, 2] / np.asarray(AREA(ours, jnp.asarray(w)))
    # Mitsuba has the rational approximation of Walter et al. (2007), which is 0.35 % off
    np.testing.assert_allclose(exact[facing], masking[facing], rtol=4e-3)


def facets_near(alpha: tuple[float, float]) -> np.ndarray:
    """200 normals within the lobe, float32."""
    slope = np.random.default_rng(7).normal(size=(200, 2)) * alpha
    normal = np.concatenate([slope, np.ones((200, 1))], -1)
    return (normal / np.linalg.norm(normal, axis=-1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("name", CASES)
def test_float32_is_float64_of_the_same_numbers(name: str):
    w = np.concatenate([directions(1000, 2), [[1e-4, 0, 1], [1, 0, 1e-5], [0, 1, 1e-6], [-1, 0, 1e-7]]])
    wh = np.concatenate([directions(500, 3), facets(CASES[name], 30).wh]).astype(np.float32)
    single = [np.asarray(f(beckmann(name), jnp.asarray(v, jnp.float32)), float) for f, v in ((AREA, w), (DENSITY, wh))]
    with jax.enable_x64(True):
        pairs = ((AREA, w.astype(np.float32)), (DENSITY, wh))
        double = [np.asarray(f(in_double(beckmann(name)), jnp.asarray(v, jnp.float64))) for f, v in pairs]
    kept = double[1] > 1e-10 * double[1].max()
    shifted = "shifted" in name
    # areas seen from behind are small differences, absolute to those seen from the front
    np.testing.assert_allclose(single[0], double[0], rtol=2e-6, atol=2e-7 if shifted else 0)
    np.testing.assert_allclose(single[1][kept], double[1][kept], rtol=4e-4 if shifted else 2e-5)


def test_area_at_grazing_is_that_of_heitz():
    """Heitz (2014, Eqs. 68, 72): cos (1 + Lambda), with erfc of scipy in float64, from the normal to the horizon."""
    theta = np.concatenate([np.linspace(0.01, 1.5, 30), np.pi / 2 - 10.0 ** np.arange(-2.0, -7.0, -1)])
    cos, sin = np.cos(theta).astype(np.float32).astype(float), np.sin(theta).astype(np.float32).astype(float)
    for alpha in (1.0, 0.1, 1e-4):
        rounded = float(np.float32(alpha))
        a = cos / (rounded * sin)
        want = cos * erfc(-a) / 2 + rounded * sin * np.exp(-(a**2)) / (2 * np.sqrt(np.pi))
        w = jnp.asarray(np.stack([sin, 0 * sin, cos], -1), jnp.float32)
        np.testing.assert_allclose(AREA(Beckmann(Isotropic(jnp.float32(alpha))), w), want, rtol=1e-6)


@pytest.mark.parametrize("name", CASES)
def test_draws_have_the_density_of_visible_normals(name: str):
    level = significance_of_each(0.01, len(CASES) * len(VIEWS))
    grid = facets(CASES[name], 480)
    u = np.random.default_rng(5).random((100_000, 2))
    with jax.enable_x64(True):
        surface = in_double(beckmann(name))
        density = np.asarray(DENSITY(surface, jnp.asarray(grid.wh)))
        for theta, phi in VIEWS:
            wo = np.asarray(spherical(jnp.array(theta), jnp.array(phi)))
            # draws are not exact where next to nothing is seen
            if float(AREA(surface, jnp.asarray(wo))) < 1e-4:
                continue
            wh = np.asarray(SAMPLE(surface, jnp.broadcast_to(wo, (len(u), 3)), jnp.asarray(u)))
            result = visible_chi_square(CASES[name], wo, wh, density, cells=12)
            assert result.p_value > level, (theta, phi, result)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("theta", [0.0, 1.0, 1.570796])
def test_drawn_normals_are_unit_visible_and_above(name: str, theta: float):
    below_one = np.nextafter(1, 0, dtype=np.float32)
    u = np.random.default_rng(6).random((2000, 2), np.float32)
    u[:5] = [[0, 0], [below_one, below_one], [0.5, 0], [below_one, 0.5], [0, 0.5]]
    wo = lift(jnp.broadcast_to(spherical(jnp.array(theta), jnp.array(0.2)), (2000, 3)))
    wh = np.asarray(SAMPLE(beckmann(name), wo, jnp.asarray(u)), float)
    np.testing.assert_allclose(np.linalg.norm(wh, axis=-1), 1.0, atol=4e-7)
    assert np.all(wh[:, 2] >= 0)
    # float32's last flat piece is sqrt(eps) wide; where nothing is seen there is nothing to draw
    if float(AREA(beckmann(name), wo[0])) > 1e-4:
        assert np.all(np.sum(wh * np.asarray(wo, float), -1) > -4e-4)
