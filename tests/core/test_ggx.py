"""GGX: quadrature over slopes, Mitsuba, 80-bit arithmetic, and draws against their density."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
import pytest

from jaxbrdf.checks.chi_square import significance_of_each
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Axes
from jaxbrdf.core.smith import lift, masked_area
from tests.compiling import jit_as_users
from tests.core.facets import CASES, VIEWS, directions, facets, in_double, slope_of, visible_chi_square

DENSITY, AREA, SAMPLE = (jit_as_users(f) for f in (Ggx.density, Ggx.projected_area, Ggx.sample_visible))


def ggx(name: str) -> Ggx:
    return Ggx(CASES[name].roughness, slope_of(CASES[name]))


@pytest.mark.parametrize("name", CASES)
def test_density_and_projected_area_are_those_of_the_slopes(name: str):
    grid = facets(CASES[name], 800)
    views = np.asarray(spherical(*jnp.array(VIEWS).T), float)
    with jax.enable_x64(True):
        density = np.asarray(DENSITY(in_double(ggx(name)), jnp.asarray(grid.wh)))
        area = np.asarray(AREA(in_double(ggx(name)), jnp.asarray(views)))
    weight = density * grid.wh[:, 2] ** 3 * grid.area
    np.testing.assert_allclose(np.sum(weight * grid.wh[:, 2]), 1.0, rtol=1e-4)
    # the tail of slopes falls with the third power only: what lies beyond the grid's last node counts
    want = [np.sum(weight * np.maximum(grid.wh @ w, 0.0)) for w in views]
    np.testing.assert_allclose(area, want, rtol=3e-3, atol=1e-6)


@pytest.mark.parametrize("alpha", [(1e-3, 0.1), (0.05, 0.4), (0.3, 0.3), (1.0, 0.6)], ids=str)
def test_terms_match_mitsuba(mitsuba_rgb, alpha: tuple[float, float]):
    reference = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, *alpha, True)
    w, wh = directions(300, 0), directions(300, 1)
    facing = np.sum(w * wh, -1) > 0
    ours = Ggx(Axes(*map(jnp.float32, alpha)))
    area = np.asarray(AREA(ours, jnp.asarray(w)))
    density = np.asarray(DENSITY(ours, jnp.asarray(wh)))
    np.testing.assert_allclose(density, [reference.eval(h) for h in wh.tolist()], rtol=2e-5)
    pairs = list(zip(w.tolist(), wh.tolist(), strict=True))
    masking = np.array([reference.smith_g1(*pair) for pair in pairs])
    np.testing.assert_allclose((w[:, 2] / area)[facing], masking[facing], rtol=2e-5)
    visible = np.array([reference.pdf(*pair) for pair in pairs])
    np.testing.assert_allclose((np.sum(w * wh, -1) * density / area)[facing], visible[facing], rtol=1e-4)


@pytest.mark.parametrize("name", CASES)
def test_float32_is_float64_of_the_same_numbers(name: str):
    w = np.concatenate([directions(1000, 2), [[1e-4, 0, 1], [1, 0, 1e-5], [0, 1, 1e-6], [-1, 0, 1e-7]]])
    wh = np.concatenate([directions(500, 3), facets(CASES[name], 30).wh]).astype(np.float32)
    single = [np.asarray(f(ggx(name), jnp.asarray(v, jnp.float32)), float) for f, v in ((AREA, w), (DENSITY, wh))]
    with jax.enable_x64(True):
        pairs = ((AREA, w.astype(np.float32)), (DENSITY, wh))
        double = [np.asarray(f(in_double(ggx(name)), jnp.asarray(v, jnp.float64))) for f, v in pairs]
    # a mean slope of 2 is subtracted: 1e-7 over the roughness's share of it, to the fourth power in the density
    np.testing.assert_allclose(single[0], double[0], rtol=1e-6 if "shifted" not in name else 4e-5)
    np.testing.assert_allclose(single[1], double[1], rtol=1e-6 if "shifted" not in name else 4e-5)


def test_area_seen_from_behind_keeps_its_digits():
    # the standard surface is seen at a cosine of -1 + 1e-6: |v| + v_z would leave nothing of float32
    w = np.float32([[0.9, 0.0, np.sqrt(0.19)], [0.999, 0.0, 0.0447]])
    surface = Ggx(Axes(jnp.float32(1e-3), jnp.float32(1e-3)), jnp.float32([1.0, 0.0]))
    x, z = w.astype(np.longdouble).T[[0, 2]]
    flat, height = (np.longdouble(np.float32(1e-3)) * x) ** 2, z - x
    want = (np.sqrt(flat + height**2) + height) / 2
    np.testing.assert_allclose(AREA(surface, jnp.asarray(w)), want.astype(float), rtol=1e-6)


@pytest.mark.parametrize("name", CASES)
def test_masking_never_takes_less_than_the_cosine(name: str):
    w = jnp.asarray(directions(2000, 4))
    area = jax.jit(masked_area)(ggx(name), w)
    assert np.all(area >= w[:, 2])


@pytest.mark.parametrize("name", CASES)
def test_draws_have_the_density_of_visible_normals(name: str):
    level = significance_of_each(0.01, len(CASES) * len(VIEWS))
    grid = facets(CASES[name], 480)
    u = np.random.default_rng(5).random((100_000, 2))
    with jax.enable_x64(True):
        surface = in_double(ggx(name))
        density = np.asarray(DENSITY(surface, jnp.asarray(grid.wh)))
        for theta, phi in VIEWS:
            wo = np.asarray(spherical(jnp.array(theta), jnp.array(phi)))
            wh = np.asarray(SAMPLE(surface, jnp.broadcast_to(wo, (len(u), 3)), jnp.asarray(u)))
            result = visible_chi_square(CASES[name], wo, wh, density, cells=12)
            assert result.p_value > level, (theta, phi, result)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("theta", [0.0, 1.0, 1.570796])
def test_drawn_normals_are_unit_visible_and_above(name: str, theta: float):
    below_one = np.nextafter(1, 0, dtype=np.float32)
    u = np.random.default_rng(6).random((2000, 2), np.float32)
    u[:4] = [[0, 0], [0, below_one], [0.5, 0], [0.5, below_one]]
    wo = lift(jnp.broadcast_to(spherical(jnp.array(theta), jnp.array(0.2)), (2000, 3)))
    wh = np.asarray(SAMPLE(ggx(name), wo, jnp.asarray(u)), float)
    np.testing.assert_allclose(np.linalg.norm(wh, axis=-1), 1.0, atol=4e-7)
    assert np.all(wh[:, 2] >= 0)
    assert np.all(np.sum(wh * np.asarray(wo, float), -1) > -4e-7)
