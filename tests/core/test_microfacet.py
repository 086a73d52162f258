"""GGX's distribution and Smith's terms: normalisation by quadrature, and Mitsuba's microfacet distribution."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
import pytest

from jaxbrdf.core.directions import spherical
from jaxbrdf.core.microfacet import (
    ggx_density,
    lift,
    sample_visible_normal,
    smith_g1,
    smith_g2,
    smith_lambda,
    visible_normal_density,
)

pytestmark = pytest.mark.usefixtures("mitsuba_rgb")

ROUGHNESS = ((1e-4, 1e-4), (1e-3, 0.1), (0.05, 0.4), (0.3, 0.3), (1.0, 0.6))


def directions(count: int, seed: int) -> np.ndarray:
    """Random unit vectors above the horizon, float32."""
    w = np.random.default_rng(seed).normal(size=(count, 3))
    w[:, 2] = np.abs(w[:, 2])
    return (w / np.linalg.norm(w, axis=-1, keepdims=True)).astype(np.float32)


def normals(alpha: tuple[float, float], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Half vectors spread like the lobe and the solid angle that each of them stands for, float64."""
    side = (np.arange(count) + 0.5) / count
    z, phi = (a.ravel() for a in np.meshgrid(1 - side, 2 * np.pi * side, indexing="ij"))
    sin = np.sqrt(1 - z * z)
    w = np.stack([sin * np.cos(phi) * alpha[0], sin * np.sin(phi) * alpha[1], z], -1)
    length = np.linalg.norm(w, axis=-1)
    return w / length[:, None], 2 * np.pi * alpha[0] * alpha[1] / length**3 / count**2


@pytest.mark.parametrize("alpha", ROUGHNESS)
def test_projected_density_integrates_to_one(alpha: tuple[float, float]):
    wh, area = normals(alpha, 400)
    density = np.asarray(ggx_density(jnp.asarray(wh, jnp.float32), *map(jnp.float32, alpha)), float)
    np.testing.assert_allclose(np.sum(density * wh[:, 2] * area), 1.0, rtol=2e-5)


@pytest.mark.parametrize("theta", [0.0, 0.8, 1.5, 1.5707])
@pytest.mark.parametrize("alpha", ROUGHNESS)
def test_visible_normals_integrate_to_one(alpha: tuple[float, float], theta: float):
    wh, area = normals(alpha, 800)
    wo = lift(spherical(jnp.array(theta), jnp.array(0.7)))
    with jax.enable_x64(True):
        density = visible_normal_density(jnp.asarray(wh), jnp.asarray(wo, jnp.float64)[None, :], *alpha)
    np.testing.assert_allclose(np.sum(np.asarray(density) * area), 1.0, rtol=2e-3)


@pytest.mark.parametrize("alpha", ROUGHNESS[1:])
def test_terms_match_mitsuba(alpha: tuple[float, float]):
    reference = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, *alpha, True)
    w, wh, a = directions(300, 0), directions(300, 1), [jnp.float32(x) for x in alpha]
    want_d = [reference.eval(h) for h in wh.tolist()]
    want_g = [reference.smith_g1(v, h) for v, h in zip(w.tolist(), wh.tolist(), strict=True)]
    want_p = [reference.pdf(v, h) for v, h in zip(w.tolist(), wh.tolist(), strict=True)]
    facing = np.sum(w * wh, -1) > 0
    np.testing.assert_allclose(ggx_density(jnp.asarray(wh), *a), want_d, rtol=2e-5)
    np.testing.assert_allclose(np.asarray(smith_g1(jnp.asarray(w), *a))[facing], np.array(want_g)[facing], rtol=2e-5)
    got_p = np.asarray(visible_normal_density(jnp.asarray(wh), jnp.asarray(w), *a))
    np.testing.assert_allclose(got_p[facing], np.array(want_p)[facing], rtol=1e-4)


@pytest.mark.parametrize("alpha", ROUGHNESS)
def test_masking_keeps_its_digits_in_float32(alpha: tuple[float, float]):
    w = np.concatenate([directions(100, 2), [[1e-4, 0, 1], [1, 0, 1e-5], [0, 1, 1e-6]]]).astype(np.float32)
    single = smith_lambda(jnp.asarray(w), *map(jnp.float32, alpha))
    x, y, z = w.astype(np.longdouble).T
    tangent = (np.longdouble(np.float32(alpha[0])) * x / z) ** 2 + (np.longdouble(np.float32(alpha[1])) * y / z) ** 2
    want = ((np.sqrt(1 + tangent) - 1) / 2).astype(float)
    # 80-bit references themselves lose 1e-19 / (alpha tan)^2
    np.testing.assert_allclose(single, want, rtol=2e-6, atol=1e-18)


def test_height_correlated_shadowing_lies_between_its_bounds():
    wi, wo = jnp.asarray(directions(500, 3)), jnp.asarray(directions(500, 4))
    a = (jnp.float32(0.3), jnp.float32(0.6))
    one, other, both = smith_g1(wi, *a), smith_g1(wo, *a), smith_g2(wi, wo, *a)
    assert np.all(both >= one * other * (1 - 1e-5))
    assert np.all(both <= jnp.minimum(one, other) * (1 + 1e-5))
    np.testing.assert_allclose(both, 1 / (1 + smith_lambda(wi, *a) + smith_lambda(wo, *a)), rtol=1e-5)


@pytest.mark.parametrize("alpha", [1e-4, 0.3, 1.0])
@pytest.mark.parametrize("theta", [0.0, 1.0, 1.5707, 1.570796])
def test_sampled_normals_are_unit_visible_and_above(alpha: float, theta: float):
    u = np.random.default_rng(0).random((2000, 2), np.float32)
    u[:4] = [[0, 0], [0, np.nextafter(1, 0, dtype=np.float32)], [0.5, 0], [0.5, np.nextafter(1, 0, dtype=np.float32)]]
    wo = lift(jnp.broadcast_to(spherical(jnp.array(theta), jnp.array(0.2)), (2000, 3)))
    wh = np.asarray(sample_visible_normal(wo, jnp.float32(alpha), jnp.float32(alpha), jnp.asarray(u)), float)
    np.testing.assert_allclose(np.linalg.norm(wh, axis=-1), 1.0, atol=3e-7)
    assert np.all(wh[:, 2] >= 0)
    assert np.all(np.sum(wh * np.asarray(wo, float), -1) > -3e-7)
