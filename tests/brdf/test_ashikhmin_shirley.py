"""Ashikhmin and Shirley's lobe against its formula in float64, its normalisation, its own sampler, and one."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxbrdf.brdf.ashikhmin_shirley import ASHIKHMIN_SHIRLEY, AshikhminShirleyParams
from jaxbrdf.checks.chi_square import chi_square, significance_of_each
from jaxbrdf.checks.finite import find_faults
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.partition import half_vector, polar
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Dielectric, Schlick
from jaxbrdf.core.roughness import Axes, Isotropic, Roughness, Tensor, Turned
from jaxbrdf.sampling.pairs import draw_pairs
from jaxbrdf.types import Query
from tests.core.facets import in_double

EVAL, PDF = jax.jit(ASHIKHMIN_SHIRLEY.eval), jax.jit(ASHIKHMIN_SHIRLEY.pdf)


def numbers(record: type, *values: float) -> Roughness:
    return record(*(jnp.array(v, jnp.float32) for v in values))


# with the lobe's axes and their turn, for the reference
LOBES = {
    "mirror": (numbers(Isotropic, 1e-4), (1e-4, 1e-4, 0.0)),
    "wide": (numbers(Isotropic, 1.0), (1.0, 1.0, 0.0)),
    "axes": (numbers(Axes, 0.3, 0.1), (0.3, 0.1, 0.0)),
    "thin": (numbers(Axes, 1.0, 1e-3), (1.0, 1e-3, 0.0)),
    "turned": (numbers(Turned, 0.5, 0.1, 0.6), (0.5, 0.1, 0.6)),
    "tensor": (numbers(Turned, 0.5, 0.1, 0.6).tensor(), (0.5, 0.1, 0.6)),
}
VIEWERS = (0.0, 0.8, 1.5)


def of(name: str) -> AshikhminShirleyParams:
    return AshikhminShirleyParams(LOBES[name][0], Schlick(jnp.array([0.9, 0.5, 0.1])))


def pairs_above(count: int, seed: int, least: float) -> Query:
    pairs = jax.jit(draw_pairs, static_argnums=1)(jax.random.key(seed), 8_000)
    high = np.flatnonzero((pairs.wi[:, 2] > least) & (pairs.wo[:, 2] > least))[:count]
    return Query(jnp.asarray(np.asarray(pairs.wi)[high]), jnp.asarray(np.asarray(pairs.wo)[high]))


def published(axes: tuple[float, float, float], wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """Ashikhmin and Shirley (2000, Eq. 4) at a reflectance of one, as it stands there, with exponents 1 / alpha^2."""
    wh = (wi + wo) / np.linalg.norm(wi + wo, axis=-1, keepdims=True)
    u, v = 1 / axes[0] ** 2, 1 / axes[1] ** 2
    c, s = np.cos(axes[2]), np.sin(axes[2])
    along, across = c * wh[:, 0] + s * wh[:, 1], c * wh[:, 1] - s * wh[:, 0]
    power = (u * along**2 + v * across**2) / (1 - wh[:, 2] ** 2)
    facing = np.sum(wh * wi, -1) * np.maximum(wi[:, 2], wo[:, 2])
    return np.sqrt((u + 1) * (v + 1)) / (8 * np.pi) * wh[:, 2] ** power / facing


@pytest.mark.parametrize("name", ["wide", "axes", "turned", "tensor"])
def test_values_are_the_published_formulas(name: str):
    query = pairs_above(2000, 0, 1e-2)
    white = of(name)._replace(fresnel=Schlick(jnp.ones(3)))
    # next to the normal the published quotient has no digits left
    wi, wo = (np.asarray(w, float) for w in query[:2])
    wide = np.linalg.norm((wi + wo)[:, :2], axis=-1) > 1e-4
    with jax.enable_x64(True):
        got = np.asarray(EVAL(*in_double((white, query))))[:, 0]
    want = published(LOBES[name][1], wi, wo)
    held = wide & (want > 1e-20)
    # a tensor of float32 entries is 1e-7 off in each, its inverse by more
    np.testing.assert_allclose(got[held], want[held], rtol=1e-4 if name == "tensor" else 1e-5)


@pytest.mark.parametrize("name", LOBES)
def test_half_vectors_integrate_to_one(name: str):
    """All viewers at the normal: d wi = 4 cos_h d wh, and only half vectors within 45 degrees send light upwards."""
    alpha_x, alpha_y, angle = LOBES[name][1]
    side = (np.arange(400) + 0.5) / 400
    z, phi = (a.ravel() for a in np.meshgrid(side, 2 * np.pi * side, indexing="ij"))
    tangent = np.sqrt(1 - z * z) / z
    x, y = alpha_x * tangent * np.cos(phi), alpha_y * tangent * np.sin(phi)
    c, s = np.cos(angle), np.sin(angle)
    wh = np.stack([c * x - s * y, s * x + c * y, np.ones_like(x)], -1)
    cos = 1 / np.linalg.norm(wh, axis=-1)
    wh *= cos[:, None]
    area = 2 * np.pi * alpha_x * alpha_y / z**3 / 400**2 * cos**3
    lit = cos > np.sqrt(0.5)
    wi = 2 * cos[:, None] * wh - [0, 0, 1]
    wo = np.broadcast_to([0.0, 0.0, 1.0], wi.shape)
    with jax.enable_x64(True):
        density = np.asarray(PDF(in_double(of(name)), Query(jnp.asarray(wi), jnp.asarray(wo))))
    below = lost_share(alpha_x, alpha_y)
    np.testing.assert_allclose(np.sum((density * 4 * cos * area)[lit]), 1 - below, rtol=5e-3)


def lost_share(alpha_x: float, alpha_y: float) -> float:
    """Mean over azimuths of the mass beyond 45 degrees, cos(45)^(e + 1), the azimuth's density being 1 / (e + 1)."""
    phi = 2 * np.pi * (np.arange(200_000) + 0.5) / 200_000
    beyond = 1 + (np.cos(phi) / alpha_x) ** 2 + (np.sin(phi) / alpha_y) ** 2
    return float(np.sum(0.5 ** (beyond / 2) / beyond) / np.sum(1 / beyond))


@pytest.mark.parametrize("name", LOBES)
def test_float32_stays_close_to_float64(name: str):
    query = pairs_above(4000, 1, 1e-6)
    single = [np.asarray(f(of(name), query), float) for f in (EVAL, PDF)]
    with jax.enable_x64(True):
        double = [np.asarray(f(*in_double((of(name), query)))) for f in (EVAL, PDF)]
    # the exponent, up to 80 before f is nothing, is rounded; a tensor's inverse more
    for got, want in zip(single, double, strict=True):
        held = want > 1e-6
        np.testing.assert_allclose(got[held], want[held], rtol=1e-4 if name == "tensor" else 3e-5)


@pytest.mark.parametrize("name", LOBES)
def test_common_checks(name: str):
    assert find_faults(ASHIKHMIN_SHIRLEY, of(name)) == []
    query = pairs_above(2000, 2, 1e-6)
    assert float(jnp.max(asymmetry(ASHIKHMIN_SHIRLEY, of(name), query))) < 2e-6
    wo = jnp.broadcast_to(spherical(jnp.array(VIEWERS), jnp.zeros(3))[:, None], (3, 2000, 3))
    u = jax.random.uniform(jax.random.key(1), wo.shape)
    mismatch = sampler_mismatch(ASHIKHMIN_SHIRLEY, of(name), wo, u)
    # a direction rounded by 6e-8 moves the half vector by that over cos_d and the roughness, and the exponent
    # by that times twice its own root
    allowed = 1e-4 + 1e-5 / min(LOBES[name][1][:2])
    assert float(jnp.quantile(mismatch.pdf, 0.999)) < allowed
    assert float(jnp.quantile(mismatch.weight, 0.999)) < allowed


def test_gradients_match_finite_differences():
    query = pairs_above(10, 3, 0.05)
    tensor = AshikhminShirleyParams(Tensor(*map(jnp.array, (0.5, 0.3, -0.2))), Dielectric(jnp.array(1.5)))
    with jax.enable_x64(True):
        wi, wo, params = in_double((*query[:2], tensor))
        check_grads(lambda p, i, o: jnp.log(EVAL(p, Query(i, o))), (params, wi, wo), order=1, modes=["rev"], rtol=1e-4)


def test_gradients_at_the_normal_are_the_series():
    """d f / d wi next to the mirror direction, where log(cos) / sin^2 is a quotient of zeros, against float64."""
    wo = jnp.array([[-0.6, 0.0, 0.8]] * 4)
    wi = jnp.array([[0.6, 0.0, 0.8], [0.6, 1e-6, 0.8], [0.6, 1e-3, 0.8], [0.6, 0.2, 0.7745967]])
    by_light = jax.jit(jax.grad(lambda i, params, o: jnp.sum(EVAL(params, Query(i, o)))))
    single = by_light(wi, of("axes"), wo)
    with jax.enable_x64(True):
        double = by_light(*in_double((wi, of("axes"), wo)))
    np.testing.assert_allclose(single, double, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("name", LOBES)
def test_sampler_agrees_with_its_density(name: str):
    level = significance_of_each(0.01, len(LOBES) * len(VIEWERS))
    alpha_x, alpha_y, angle = LOBES[name][1]
    with jax.enable_x64(name == "mirror"):
        params = in_double(of(name)) if name == "mirror" else of(name)
        for index, theta in enumerate(VIEWERS):
            wo = spherical(jnp.array(theta), jnp.array(0.7))
            cells = half_vector(tuple(np.asarray(wo, float)), alpha_x, alpha_y) if angle == 0 else polar(spread=0.3)
            result = chi_square(
                jax.random.key(index),
                ASHIKHMIN_SHIRLEY,
                params,
                wo,
                partition=cells,
                samples=50_000,
                points=32,
                cells=16,
            )
            assert result.p_value > level, (theta, result)


@pytest.mark.parametrize("name", LOBES)
def test_no_albedo_is_above_one(name: str):
    white = of(name)._replace(fresnel=Schlick(jnp.ones(3)))
    for theta in (0.0, 0.8, 1.3, 1.55):
        wo = spherical(jnp.array(theta), jnp.array(0.7))
        albedo = directional_albedo(jax.random.key(6), ASHIKHMIN_SHIRLEY, white, wo, samples=20_000)
        assert np.all(albedo.value <= 1.0)
        if name == "mirror" and theta < 1.5:
            np.testing.assert_allclose(albedo.value, 1.0, atol=1e-3)
