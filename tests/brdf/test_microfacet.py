"""The microfacet lobe with every distribution and roughness, against Mitsuba, float64, quadrature and itself."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import mitsuba as mi
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxbrdf.brdf.microfacet import MICROFACET, SEPARABLE_MICROFACET, MicrofacetParams, ggx
from jaxbrdf.checks.chi_square import chi_square, significance_of_each
from jaxbrdf.checks.finite import find_faults
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.checks.partition import half_vector, polar
from jaxbrdf.checks.reciprocity import asymmetry
from jaxbrdf.checks.sampler import sampler_mismatch
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Conductor, Dielectric, Fresnel, Schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Axes, Isotropic, Roughness, Tensor, Turned
from jaxbrdf.sampling.pairs import draw_pairs
from jaxbrdf.types import Query
from tests.core.facets import in_double

pytestmark = pytest.mark.usefixtures("mitsuba_rgb")

GOLD = ((0.223, 0.428, 1.335), (3.204, 2.460, 1.872))
ALPHAS = ((1e-4, 1e-4), (0.01, 1e-4), (0.1, 0.1), (1.0, 1e-3), (1.0, 1.0))
KINDS = {"ggx": Ggx, "beckmann": Beckmann}
VIEWERS = (0.0, 0.8, 1.55)
EVAL, PDF = jax.jit(MICROFACET.eval), jax.jit(MICROFACET.pdf)
SEPARABLE = jax.jit(SEPARABLE_MICROFACET.eval)


def numbers(record: type, *values: float) -> Roughness:
    return record(*(jnp.array(v, jnp.float32) for v in values))


FORMS = {
    "isotropic": (numbers(Isotropic, 0.3), None),
    "axes": (numbers(Axes, 0.08, 0.35), None),
    "turned": (numbers(Turned, 0.9, 0.1, 0.4), None),
    "tensor": (numbers(Tensor, 0.5, 0.3, -0.2), None),
    "slope": (numbers(Tensor, 0.5, 0.3, -0.2), jnp.array([0.5, -0.8])),
}
CASES = [*(("ggx", form) for form in FORMS), ("beckmann", "axes"), ("beckmann", "slope")]


def gold(distribution: Ggx | Beckmann) -> MicrofacetParams:
    return MicrofacetParams(distribution, Conductor(*map(jnp.array, GOLD)))


def white(distribution: Ggx | Beckmann) -> MicrofacetParams:
    return MicrofacetParams(distribution, Schlick(jnp.ones(3)))


def of_axes(kind: str, alpha: tuple[float, float]) -> Ggx | Beckmann:
    return KINDS[kind](numbers(Axes, *alpha))


def of_form(kind: str, form: str) -> Ggx | Beckmann:
    return KINDS[kind](*FORMS[form])


def pairs_above(count: int, seed: int, least: float = 1e-3) -> Query:
    """Pairs of which many are close to the mirror configuration, cosines at least `least`."""
    pairs = jax.jit(draw_pairs, static_argnums=1)(jax.random.key(seed), 16_000)
    high = np.flatnonzero((pairs.wi[:, 2] > least) & (pairs.wo[:, 2] > least))
    pick = np.random.default_rng(seed).choice(high, count, replace=False)
    return Query(jnp.asarray(np.asarray(pairs.wi)[pick]), jnp.asarray(np.asarray(pairs.wo)[pick]))


def rgb(value: tuple[float, ...]) -> dict:
    return {"type": "rgb", "value": list(value)}


def mitsuba_gold(kind: str, alpha: tuple[float, float]) -> mi.BSDF:
    eta, k = map(rgb, GOLD)
    names = {"type": "roughconductor", "distribution": kind, "sample_visible": True, "eta": eta, "k": k}
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


@pytest.mark.parametrize("alpha", [(0.01, 0.01), (0.1, 0.1), (0.08, 0.35), (0.5, 0.2), (1.0, 1.0)], ids=str)
def test_separable_ggx_is_mitsubas_conductor(alpha: tuple[float, float]):
    query = pairs_above(300, 0, least=1e-2)
    want_f, want_pdf = mitsuba_values(mitsuba_gold("ggx", alpha), query)
    params = gold(of_axes("ggx", alpha))
    f, pdf = np.asarray(SEPARABLE(params, query), float), PDF(params, query)
    assert np.median(np.abs(f / want_f - 1)) <= 1e-5
    # Mitsuba's own float32 loses digits in 1 / cos^2 of the half vector at small roughness
    tolerance = 1e-4 + 2e-6 / min(alpha)
    np.testing.assert_allclose(f, want_f, rtol=tolerance)
    np.testing.assert_allclose(pdf, want_pdf, rtol=tolerance)


@pytest.mark.parametrize("alpha", [(0.1, 0.1), (0.08, 0.35), (1.0, 1.0)], ids=str)
def test_separable_beckmann_is_mitsubas_up_to_its_rational_masking(alpha: tuple[float, float]):
    query = pairs_above(300, 0, least=1e-2)
    want_f, want_pdf = mitsuba_values(mitsuba_gold("beckmann", alpha), query)
    params = gold(of_axes("beckmann", alpha))
    f, pdf = np.asarray(SEPARABLE(params, query), float), np.asarray(PDF(params, query), float)
    held = (want_f > 1e-12).all(-1)
    assert held.mean() > 0.3
    # the approximation of Walter et al. (2007) is up to 0.35 % off, here twice, and once in the density
    np.testing.assert_allclose(f[held], want_f[held], rtol=7.5e-3)
    np.testing.assert_allclose(pdf[held], want_pdf[held], rtol=4e-3)


@pytest.mark.parametrize("alpha", [0.05, 0.4])
def test_dielectric_matches_mitsubas_reflection(alpha: float):
    query = pairs_above(200, 1, least=1e-2)
    bsdf = mi.load_dict(
        {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha, "int_ior": 1.5, "ext_ior": 1.0}
    )
    want, _ = mitsuba_values(bsdf, query)
    params = ggx(jnp.array(alpha), jnp.array(alpha), Dielectric(jnp.array(1.5)))
    np.testing.assert_allclose(SEPARABLE(params, query), want, rtol=1e-3)


def test_correlated_masking_is_the_textbooks():
    """G2 over G1 G1 is (1 + L_i)(1 + L_o) / (1 + L_i + L_o), with GGX's Lambda in float64 (Heitz 2014, Eq. 72)."""
    query, params = pairs_above(300, 2, least=1e-2), gold(of_axes("ggx", (0.08, 0.35)))

    def smith(w: jax.Array) -> np.ndarray:
        x, y, z = np.asarray(w, float).T
        return (np.sqrt(1 + ((0.08 * x) ** 2 + (0.35 * y) ** 2) / z**2) - 1) / 2

    one, other = smith(query.wi), smith(query.wo)
    want = SEPARABLE(params, query) * ((1 + one) * (1 + other) / (1 + one + other))[:, None]
    np.testing.assert_allclose(EVAL(params, query), want, rtol=3e-6)


def test_forms_of_one_roughness_are_one_lobe():
    """Turned and tensor against axes in a frame that is turned instead: cos = 0.6, sin = 0.8."""
    query = pairs_above(500, 3, least=1e-2)
    frame = jnp.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    back = Query(query.wi @ frame, query.wo @ frame)
    turned = numbers(Turned, 0.5, 0.1, float(np.arctan2(0.8, 0.6)))
    for kind in KINDS.values():
        want = np.asarray(EVAL(gold(kind(numbers(Axes, 0.5, 0.1))), back), float)
        held = want > 1e-4 * want.max()
        for roughness in (turned, turned.tensor()):
            np.testing.assert_allclose(EVAL(gold(kind(roughness)), query)[held], want[held], rtol=2e-4)
        unshifted = gold(kind(turned, jnp.zeros(2)))
        np.testing.assert_allclose(EVAL(unshifted, query), EVAL(gold(kind(turned)), query), rtol=1e-5)


@pytest.mark.parametrize("alpha", ALPHAS, ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_float32_stays_close_to_float64(kind: str, alpha: tuple[float, float]):
    compare_precisions(gold(of_axes(kind, alpha)), 3e-6 if kind == "ggx" else 2e-5)


@pytest.mark.parametrize(("kind", "form"), CASES)
def test_forms_stay_close_to_float64(kind: str, form: str):
    compare_precisions(gold(of_form(kind, form)), 2e-5 if kind == "ggx" else 2e-4)


def compare_precisions(params: MicrofacetParams, tolerance: float) -> None:
    query = pairs_above(2000, 2, least=1e-6)
    single = np.asarray(EVAL(params, query), float), np.asarray(PDF(params, query), float)
    with jax.enable_x64(True):
        double = np.asarray(EVAL(*in_double((params, query)))), np.asarray(PDF(*in_double((params, query))))
    # the same rounded directions on both sides: what is left is arithmetic alone. Beckmann's exponent, rounded, is an
    # error of its tail, which is left out where it is far below the lobe
    for got, want in zip(single, double, strict=True):
        held = want > 1e-7
        assert held.mean() > 0.03
        np.testing.assert_allclose(got[held], want[held], rtol=tolerance)


@pytest.mark.parametrize("kind", KINDS)
def test_values_and_gradients_are_finite_about_a_mean_slope(kind: str):
    """Of a tensor; the table of all checks has the other forms."""
    assert find_faults(MICROFACET, gold(of_form(kind, "slope"))) == []


@pytest.mark.parametrize("alpha", ALPHAS, ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_values_and_gradients_are_finite_at_every_roughness(kind: str, alpha: tuple[float, float]):
    assert find_faults(MICROFACET, gold(of_axes(kind, alpha))) == []


def test_gradients_match_finite_differences():
    """By every parameter of Beckmann's lobe about a mean slope, which the table of all checks has not."""
    query = pairs_above(20, 3, least=0.05)
    with jax.enable_x64(True):
        wi, wo, params = in_double((*query[:2], gold(of_form("beckmann", "slope"))))
        check_grads(lambda p, i, o: jnp.log(EVAL(p, Query(i, o))), (params, wi, wo), order=1, modes=["rev"], rtol=1e-4)


@pytest.mark.parametrize(("kind", "form"), CASES)
def test_reciprocity(kind: str, form: str):
    query = pairs_above(2000, 4, least=1e-6)
    assert float(jnp.max(asymmetry(MICROFACET, gold(of_form(kind, form)), query))) < 2e-6
    assert float(jnp.max(asymmetry(SEPARABLE_MICROFACET, gold(of_form(kind, form)), query))) < 2e-6


@pytest.mark.parametrize("alpha", ALPHAS, ids=str)
def test_sampler_agrees_with_its_density(alpha: tuple[float, float]):
    level = significance_of_each(0.01, 2 * len(ALPHAS) * len(VIEWERS))
    # at a grazing view float32 directions are too coarse for the cells of a lobe of 1e-4
    with jax.enable_x64(min(alpha) < 1e-3):
        for kind in KINDS:
            params = gold(of_axes(kind, alpha))
            params = in_double(params) if min(alpha) < 1e-3 else params
            for index, theta in enumerate(VIEWERS):
                wo = spherical(jnp.array(theta), jnp.array(0.7))
                cells = polar() if min(alpha) > 0.4 else half_vector(tuple(np.asarray(wo, float)), *alpha)
                result = chi_square(jax.random.key(index), MICROFACET, params, wo, partition=cells, samples=30_000)
                assert result.p_value > level, (kind, theta, result)


@pytest.mark.parametrize("kind", KINDS)
def test_sampler_about_a_mean_slope_agrees_with_its_density(kind: str):
    """Of a tensor; the table of all checks has the other forms."""
    level = significance_of_each(0.01, 3 * len(KINDS))
    for index, theta in enumerate((0.0, 0.8, 1.4)):
        wo = spherical(jnp.array(theta), jnp.array(0.7))
        # seen from behind, the cells of a coarser quadrature are off
        cells = polar(spread=0.3)
        result = chi_square(
            jax.random.key(index),
            MICROFACET,
            gold(of_form(kind, "slope")),
            wo,
            partition=cells,
            samples=30_000,
            points=64,
            cells=16,
        )
        assert result.p_value > level, (theta, result)


@pytest.mark.parametrize(("kind", "form"), CASES)
def test_samples_tell_what_eval_and_pdf_tell(kind: str, form: str):
    wo = jnp.broadcast_to(spherical(jnp.array(VIEWERS), jnp.full(3, 0.3))[:, None], (3, 3000, 3))
    mismatch = sampler_mismatch(
        MICROFACET, gold(of_form(kind, form)), wo, jax.random.uniform(jax.random.key(5), wo.shape)
    )
    # steep facets of Beckmann's tail turn the view's rounding into the exponent's, 2 tan^2 / alpha^2 times as large
    assert float(jnp.quantile(mismatch.pdf, 0.999)) < 2e-4
    assert float(jnp.quantile(mismatch.weight, 0.999)) < 3e-4


@pytest.mark.parametrize("alpha", ALPHAS, ids=str)
def test_samples_of_narrow_lobes_tell_what_eval_and_pdf_tell(alpha: tuple[float, float]):
    wo = jnp.broadcast_to(spherical(jnp.array(VIEWERS), jnp.full(3, 0.3))[:, None], (3, 3000, 3))
    u = jax.random.uniform(jax.random.key(5), wo.shape)
    mismatch = sampler_mismatch(MICROFACET, gold(of_axes("ggx", alpha)), wo, u)
    # a direction rounded by 6e-8 moves a half vector by 6e-8 / (2 cos_d alpha) of the lobe's width: 1.5e-6 / alpha
    # where a grazing viewer makes cos_d 0.02. f varies by up to 8 a width there, by distribution and masking, the
    # density less
    assert float(jnp.max(mismatch.pdf)) < 1e-5 + 3e-6 / min(alpha)
    assert float(jnp.max(mismatch.weight)) < 1e-4 + 1.2e-5 / min(alpha)


@pytest.mark.parametrize(("kind", "form"), [("ggx", "slope"), ("beckmann", "slope")])
def test_white_furnace_gains_nothing(kind: str, form: str):
    for theta, phi in ((0.0, 0.7), (0.8, 0.7), (1.3, -2.0), (1.55, 2.5)):
        wo = spherical(jnp.array(theta), jnp.array(phi))
        albedo = directional_albedo(jax.random.key(6), MICROFACET, white(of_form(kind, form)), wo, samples=20_000)
        assert np.all(albedo.value <= 1 + 1e-5 + 4 * albedo.standard_error)


def test_a_mirror_loses_nothing():
    for alpha in (1e-4, 1e-2):
        wo = spherical(jnp.array(1.3), jnp.array(0.7))
        params = white(of_axes("ggx", (alpha, alpha)))
        albedo = directional_albedo(jax.random.key(6), MICROFACET, params, wo, samples=20_000)
        np.testing.assert_allclose(albedo.value, 1.0, atol=2e-2)


@pytest.mark.parametrize(("kind", "form"), [("ggx", "axes"), ("beckmann", "slope")])
def test_rough_albedo_matches_quadrature(kind: str, form: str):
    # an estimate by another route: eval alone, summed over a fine grid of directions
    wo = spherical(jnp.array(0.8), jnp.array(0.7))
    points = np.stack(np.meshgrid(*[(np.arange(600) + 0.5) / 600] * 2, indexing="ij"), -1).reshape(-1, 2)
    directions, area = polar().place(points)
    wi = jnp.asarray(directions, jnp.float32)
    f = np.asarray(EVAL(gold(of_form(kind, form)), Query(wi, jnp.broadcast_to(wo, wi.shape))), float)
    want = np.sum(f * (np.maximum(directions[:, 2], 0) * area)[:, None], 0) / len(points)
    albedo = directional_albedo(jax.random.key(7), MICROFACET, gold(of_form(kind, form)), wo)
    assert np.all(np.abs(albedo.value - want) < 4 * albedo.standard_error + 1e-4)


def test_roughness_and_slope_per_query_and_odd_batch_shapes():
    query = jax.tree.map(lambda x: x.reshape(2, 5, 3, 3), pairs_above(30, 8))
    alpha = jax.random.uniform(jax.random.key(9), (2, 5, 3), minval=0.05)
    slope = jax.random.normal(jax.random.key(10), (2, 5, 3, 2))
    fresnel: Fresnel = Schlick(jnp.array([0.9, 0.5, 0.1]))
    for kind in KINDS.values():
        varying = EVAL(MicrofacetParams(kind(Axes(alpha, 0.5 * alpha), slope), fresnel), query)
        one = kind(Axes(alpha[1, 2, 0], 0.5 * alpha[1, 2, 0]), slope[1, 2, 0])
        here = Query(query.wi[1, 2, 0], query.wo[1, 2, 0])
        np.testing.assert_allclose(varying[1, 2, 0], EVAL(MicrofacetParams(one, fresnel), here), rtol=1e-5)


def test_parameters_outside_their_range_are_clamped():
    query = pairs_above(50, 11)
    beyond = white(KINDS["ggx"](numbers(Axes, 7.0, 0.0)))._replace(fresnel=Schlick(jnp.array([2.0, -1.0, 0.5])))
    nearest = MicrofacetParams(of_axes("ggx", (1.0, 1e-4)), Schlick(jnp.array([1.0, 0.0, 0.5])))
    np.testing.assert_array_equal(EVAL(beyond, query), EVAL(nearest, query))
