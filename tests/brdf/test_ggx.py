"""GGX against Mitsuba, float64, quadrature and its own sampler."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxbrdf.brdf.ggx import GGX, GgxParams
from jaxbrdf.checks.chi_square import chi_square, significance_of_each
from jaxbrdf.checks.finite import find_faults
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.partition import half_vector, polar
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Conductor, Dielectric, Schlick
from jaxbrdf.sampling.pairs import draw_pairs
from jaxbrdf.types import Query

pytestmark = pytest.mark.usefixtures("mitsuba_rgb")

GOLD = ((0.223, 0.428, 1.335), (3.204, 2.460, 1.872))
ROUGHNESS = ((1e-4, 1e-4), (1e-3, 1e-3), (0.01, 1e-4), (0.1, 0.1), (0.08, 0.35), (1.0, 1e-3), (0.5, 0.5), (1.0, 1.0))
VIEWERS = (0.0, 0.8, 1.3, 1.55)
EVAL, PDF = jax.jit(GGX.eval), jax.jit(GGX.pdf)


def gold(alpha: tuple[float, float]) -> GgxParams:
    return GgxParams(jnp.array(alpha[0]), jnp.array(alpha[1]), Conductor(*map(jnp.array, GOLD)))


def white(alpha: tuple[float, float]) -> GgxParams:
    return GgxParams(jnp.array(alpha[0]), jnp.array(alpha[1]), Schlick(jnp.ones(3)))


def pairs_above(count: int, seed: int, least: float = 1e-3) -> Query:
    """Pairs of which many are close to the mirror configuration, cosines at least `least`."""
    pairs = jax.jit(draw_pairs, static_argnums=1)(jax.random.key(seed), 16_000)
    high = np.flatnonzero((pairs.wi[:, 2] > least) & (pairs.wo[:, 2] > least))
    pick = np.random.default_rng(seed).choice(high, count, replace=False)
    return Query(jnp.asarray(np.asarray(pairs.wi)[pick]), jnp.asarray(np.asarray(pairs.wo)[pick]))


def rgb(value: tuple[float, ...]) -> dict:
    return {"type": "rgb", "value": list(value)}


def mitsuba_gold(alpha: tuple[float, float]) -> mi.BSDF:
    eta, k = map(rgb, GOLD)
    names = {"type": "roughconductor", "distribution": "ggx", "sample_visible": True, "eta": eta, "k": k}
    return mi.load_dict(names | {"alpha_u": alpha[0], "alpha_v": alpha[1]})


def mitsuba_values(bsdf: mi.BSDF, query: Query) -> tuple[np.ndarray, np.ndarray]:
    """f without the cosine, and the density of wi given wo, which Mitsuba calls wo given wi."""
    context, f, pdf = mi.BSDFContext(), [], []
    for wi, wo in zip(np.asarray(query.wi).tolist(), np.asarray(query.wo).tolist(), strict=True):
        interaction = mi.SurfaceInteraction3f()
        interaction.wi = wo
        f.append(np.array(bsdf.eval(context, interaction, wi)) / wi[2])
        pdf.append(bsdf.pdf(context, interaction, wi))
    return np.array(f), np.array(pdf)


def correlation(alpha: tuple[float, float], query: Query) -> np.ndarray:
    """G2 over G1 G1, `(n, 1)`: Mitsuba multiplies masking and shadowing as if they were independent."""

    def smith(w: jax.Array) -> np.ndarray:
        x, y, z = np.asarray(w, float).T
        return (np.sqrt(1 + ((alpha[0] * x) ** 2 + (alpha[1] * y) ** 2) / z**2) - 1) / 2

    one, other = smith(query.wi), smith(query.wo)
    return ((1 + one) * (1 + other) / (1 + one + other))[:, None]


@pytest.mark.parametrize("alpha", [(0.01, 0.01), (0.1, 0.1), (0.08, 0.35), (0.5, 0.2), (1.0, 1.0)], ids=str)
def test_conductor_matches_mitsuba(alpha: tuple[float, float]):
    query = pairs_above(300, 0, least=1e-2)
    want_f, want_pdf = mitsuba_values(mitsuba_gold(alpha), query)
    # Mitsuba's own float32 loses digits in 1 / cos^2 of the half vector at small roughness
    tolerance = 1e-4 + 2e-6 / min(alpha)
    np.testing.assert_allclose(EVAL(gold(alpha), query), want_f * correlation(alpha, query), rtol=tolerance)
    np.testing.assert_allclose(PDF(gold(alpha), query), want_pdf, rtol=tolerance)


@pytest.mark.parametrize("alpha", [0.05, 0.4])
def test_dielectric_matches_mitsubas_reflection(alpha: float):
    query = pairs_above(200, 1, least=1e-2)
    bsdf = mi.load_dict(
        {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha, "int_ior": 1.5, "ext_ior": 1.0}
    )
    params = GgxParams(jnp.array(alpha), jnp.array(alpha), Dielectric(jnp.array(1.5)))
    want, _ = mitsuba_values(bsdf, query)
    np.testing.assert_allclose(EVAL(params, query), want * correlation((alpha, alpha), query), rtol=1e-3)


@pytest.mark.parametrize("alpha", ROUGHNESS, ids=str)
def test_float32_stays_close_to_float64(alpha: tuple[float, float]):
    query = pairs_above(4000, 2, least=1e-6)
    single = np.asarray(EVAL(gold(alpha), query), float), np.asarray(PDF(gold(alpha), query), float)
    with jax.enable_x64(True):
        double = jax.tree.map(lambda x: jnp.asarray(np.asarray(x), jnp.float64), (gold(alpha), query))
        want = np.asarray(EVAL(*double)), np.asarray(PDF(*double))
    # the same rounded directions on both sides: what is left is arithmetic alone, not the directions' own rounding
    np.testing.assert_allclose(single[0], want[0], rtol=3e-6)
    np.testing.assert_allclose(single[1], want[1], rtol=3e-6)


@pytest.mark.parametrize("alpha", ROUGHNESS, ids=str)
def test_values_and_gradients_are_finite(alpha: tuple[float, float]):
    assert find_faults(GGX, gold(alpha)) == []
    assert find_faults(GGX, white(alpha)) == []


@pytest.mark.parametrize("alpha", [(0.1, 0.3), (0.5, 0.5)], ids=str)
def test_gradients_match_finite_differences(alpha: tuple[float, float]):
    query = pairs_above(20, 3, least=0.05)
    with jax.enable_x64(True):
        wi, wo, params = jax.tree.map(lambda x: jnp.asarray(np.asarray(x), jnp.float64), (*query[:2], gold(alpha)))
        check_grads(lambda p, i, o: jnp.log(EVAL(p, Query(i, o))), (params, wi, wo), order=1, modes=["rev"], rtol=1e-4)


@pytest.mark.parametrize("alpha", ROUGHNESS, ids=str)
def test_reciprocity(alpha: tuple[float, float]):
    assert (
        float(jnp.max(jax.jit(asymmetry, static_argnums=0)(GGX, gold(alpha), pairs_above(2000, 4, least=1e-6)))) < 2e-6
    )


@pytest.mark.parametrize("alpha", ROUGHNESS, ids=str)
def test_sampler_agrees_with_its_density(alpha: tuple[float, float]):
    level = significance_of_each(0.01, len(ROUGHNESS) * len(VIEWERS))
    # at a grazing view float32 directions are too coarse for the cells of a lobe of 1e-4
    with jax.enable_x64(min(alpha) < 1e-3):
        for index, theta in enumerate(VIEWERS):
            wo = spherical(jnp.array(theta), jnp.array(0.7))
            cells = polar() if min(alpha) > 0.4 else half_vector(tuple(np.asarray(wo, float)), *alpha)
            result = chi_square(jax.random.key(index), GGX, gold(alpha), wo, partition=cells, samples=100_000)
            assert result.p_value > level, (theta, result)


@pytest.mark.parametrize("alpha", ROUGHNESS, ids=str)
def test_samples_tell_what_eval_and_pdf_tell(alpha: tuple[float, float]):
    wo = jnp.broadcast_to(spherical(jnp.array(VIEWERS), jnp.full(4, 0.3))[:, None], (4, 5000, 3))
    mismatch = jax.jit(sampler_mismatch, static_argnums=0)(
        GGX, gold(alpha), wo, jax.random.uniform(jax.random.key(5), (4, 5000, 3))
    )
    # a direction rounded by 6e-8 moves a half vector by 6e-8 / (2 cos_d alpha) of the lobe's width: 1.5e-6 / alpha
    # where a grazing viewer makes cos_d 0.02. f varies by up to 8 a width there, by distribution and masking, the
    # density less
    assert float(jnp.max(mismatch.pdf)) < 1e-5 + 3e-6 / min(alpha)
    assert float(jnp.max(mismatch.weight)) < 1e-4 + 1.2e-5 / min(alpha)


@pytest.mark.parametrize("alpha", ROUGHNESS, ids=str)
@pytest.mark.parametrize("theta", VIEWERS)
def test_white_furnace_gains_nothing(alpha: tuple[float, float], theta: float):
    wo = spherical(jnp.array(theta), jnp.array(0.7))
    albedo = directional_albedo(jax.random.key(6), GGX, white(alpha), wo, samples=20_000)
    assert np.all(albedo.value <= 1 + 1e-5 + 4 * albedo.standard_error)
    if max(alpha) <= 1e-2 and theta <= 1.3:
        np.testing.assert_allclose(albedo.value, 1.0, atol=2e-2)


def test_rough_albedo_matches_quadrature():
    # an estimate by another route: eval alone, summed over a fine grid of directions
    wo = spherical(jnp.array(0.8), jnp.array(0.7))
    points = np.stack(np.meshgrid(*[(np.arange(600) + 0.5) / 600] * 2, indexing="ij"), -1).reshape(-1, 2)
    directions, area = polar().place(points)
    wi = jnp.asarray(directions, jnp.float32)
    f = np.asarray(EVAL(gold((0.3, 0.5)), Query(wi, jnp.broadcast_to(wo, wi.shape))), float)
    want = np.sum(f * (np.maximum(directions[:, 2], 0) * area)[:, None], 0) / len(points)
    albedo = directional_albedo(jax.random.key(7), GGX, gold((0.3, 0.5)), wo)
    assert np.all(np.abs(albedo.value - want) < 4 * albedo.standard_error + 1e-4)


def test_roughness_per_query_and_odd_batch_shapes():
    query = jax.tree.map(lambda x: x.reshape(2, 5, 3, 3), pairs_above(30, 8))
    alpha = jax.random.uniform(jax.random.key(9), (2, 5, 3), minval=0.05)
    varying = EVAL(GgxParams(alpha, alpha, Schlick(jnp.array([0.9, 0.5, 0.1]))), query)
    one = GgxParams(alpha[1, 2, 0], alpha[1, 2, 0], Schlick(jnp.array([0.9, 0.5, 0.1])))
    np.testing.assert_allclose(varying[1, 2, 0], EVAL(one, Query(query.wi[1, 2, 0], query.wo[1, 2, 0])), rtol=1e-6)
