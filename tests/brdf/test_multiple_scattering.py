"""Energy that microfacets lose: tables against quadrature by other means, the white furnace, the lobe's checks."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams
from jaxbrdf.brdf.microfacet_loss import loss, mean_loss
from jaxbrdf.brdf.multiple_scattering import MULTIPLE_SCATTERING, mean_reflectance
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.core.beckmann import Beckmann
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Conductor, Dielectric, Fresnel, Schlick, diffuse_reflectance
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Axes, Isotropic, Roughness, Tensor, Turned
from jaxbrdf.sampling.pairs import draw_pairs
from jaxbrdf.types import Query
from tests.core.facets import in_double

KINDS = {"ggx": Ggx, "beckmann": Beckmann}
ALPHAS = (1e-4, 0.03, 0.1, 0.25, 0.5, 1.0)
ANISOTROPIC = ((1.0, 0.1), (0.5, 0.1), (1.0, 1e-3), (0.1, 0.02))
LOSS, MEAN = jax.jit(loss), jax.jit(mean_loss)
EVAL, PDF = jax.jit(MULTIPLE_SCATTERING.eval), jax.jit(MULTIPLE_SCATTERING.pdf)
ALBEDO = jax.jit(MULTIPLE_SCATTERING.albedo)
SINGLE = jax.jit(MICROFACET.sample)
COSINES = (1.0, 0.7, 0.4, 0.1, 1e-2, 1e-3)
AZIMUTHS = (0.0, 0.6, 1.3, 1.5708)


def numbers(record: type, *values: float) -> Roughness:
    return record(*(jnp.array(v, jnp.float32) for v in values))


def white(kind: str, roughness: Roughness) -> MicrofacetParams:
    return MicrofacetParams(KINDS[kind](roughness), Schlick(jnp.ones(3)))


def views(cosines: tuple[float, ...], azimuths: tuple[float, ...]) -> jax.Array:
    """`(n, 3)`, made of the cosines themselves."""
    mu, phi = (jnp.asarray(x.ravel()) for x in np.meshgrid(cosines, azimuths))
    sin = jnp.sqrt((1 - mu) * (1 + mu))
    return jnp.stack([sin * jnp.cos(phi), sin * jnp.sin(phi), mu], -1)


def single_albedo(params: MicrofacetParams, wo: jax.Array, *, side: int = 192) -> np.ndarray:
    """Mean weight of the lobe's own sampler over a regular grid of its square: not how the tables were made."""
    grid = (jnp.arange(side) + 0.5) / side
    u = jnp.stack([jnp.zeros((side, side)), *jnp.meshgrid(grid, grid)], -1).reshape(-1, 3)
    wide = jnp.broadcast_to(wo[:, None], (len(wo), len(u), 3))
    drawn = SINGLE(params, Query(wide, wide), jnp.broadcast_to(u, wide.shape))
    return np.asarray(jnp.mean(drawn.weight[..., 0], 1))


@pytest.mark.parametrize("kind", KINDS)
def test_isotropic_losses_are_within_a_thousandth(kind: str):
    with jax.enable_x64(True):
        wo = views(COSINES, (0.3,))
        for alpha in ALPHAS:
            params = white(kind, Isotropic(jnp.array(alpha)))
            total = single_albedo(params, wo) + np.asarray(LOSS(params.distribution, wo))
            np.testing.assert_allclose(total, 1.0, atol=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_anisotropic_losses_are_within_a_two_hundredth(kind: str):
    with jax.enable_x64(True):
        wo = views(COSINES, AZIMUTHS)
        for alpha_x, alpha_y in ANISOTROPIC:
            params = white(kind, Turned(jnp.array(alpha_x), jnp.array(alpha_y), jnp.array(0.2)))
            total = single_albedo(params, wo, side=96) + np.asarray(LOSS(params.distribution, wo))
            np.testing.assert_allclose(total, 1.0, atol=6e-3)


def test_what_ggx_of_roughness_one_loses_at_the_normal_is_log_two():
    """With alpha = 1 and c = cos_i, D = 1 / pi and f cos_i = 1 / (2 pi) c / (1 + c): E = 1 - ln 2."""
    lost = float(LOSS(Ggx(Isotropic(jnp.array(1.0))), jnp.array([0.0, 0.0, 1.0])))
    assert lost == pytest.approx(np.log(2.0), abs=3e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_the_furnace_is_white_by_quadrature_of_the_lobe_itself(kind: str):
    """Integral of f cos over the hemisphere, in log(mu) and azimuth: what the single scattering lost."""
    points, weights = np.polynomial.legendre.leggauss(16)
    ends = np.linspace(np.log(1e-8), 0.0, 25)
    log = ((ends[:-1, None] + ends[1:, None]) / 2 + np.diff(ends)[:, None] / 2 * points).ravel()
    mass = (np.diff(ends)[:, None] / 2 * weights).ravel()
    mu, share = np.exp(log), np.full(64, 1 / 64)
    with jax.enable_x64(True):
        wi = views(tuple(mu), tuple(2 * np.pi * (np.arange(64) + 0.5) / 64)).reshape(64, -1, 3)
        wo = views((1.0, 0.3, 1e-2), (0.7,))
        cases = [Isotropic(jnp.array(a)) for a in ALPHAS] + [Axes(jnp.array(a), jnp.array(b)) for a, b in ANISOTROPIC]
        for roughness in cases:
            params = white(kind, roughness)
            for w in wo:
                f = np.asarray(EVAL(params, Query(wi, jnp.broadcast_to(w, wi.shape))))[..., 0]
                back = 2 * np.pi * np.sum(f * mu * mu * mass * share[:, None])
                lost = float(LOSS(params.distribution, w))
                tolerance = 1e-3 if isinstance(roughness, Isotropic) else 3e-3
                assert back == pytest.approx(lost, abs=tolerance * lost + 1e-12), (roughness, w)


@pytest.mark.parametrize("kind", KINDS)
def test_forms_of_one_roughness_lose_the_same(kind: str):
    wo = views((1.0, 0.5, 0.05), (0.0, 0.9))
    turned = numbers(Turned, 0.5, 0.1, 0.6)
    want = LOSS(KINDS[kind](turned), wo)
    np.testing.assert_allclose(LOSS(KINDS[kind](turned.tensor()), wo), want, rtol=1e-4)
    np.testing.assert_allclose(MEAN(KINDS[kind](turned.tensor())), MEAN(KINDS[kind](turned)), rtol=1e-5)
    np.testing.assert_allclose(MEAN(KINDS[kind](numbers(Axes, 0.1, 0.5))), MEAN(KINDS[kind](turned)), rtol=1e-5)
    # the general table on a circle
    circle = numbers(Axes, 0.4, 0.4)
    np.testing.assert_allclose(LOSS(KINDS[kind](circle), wo), LOSS(KINDS[kind](numbers(Isotropic, 0.4)), wo), atol=4e-3)


def test_the_loss_vanishes_with_the_roughness_and_its_gradient_is_finite():
    wo = views((1.0, 0.3, 1e-3, 1e-7), (0.2,))
    by_alpha = jax.vmap(jax.grad(lambda a, w: loss(Ggx(Isotropic(a)), w)), in_axes=(None, 0))
    f = EVAL(white("ggx", numbers(Isotropic, 1e-4)), Query(wo[:1], wo[:1]))
    assert 0 < float(f[0, 0]) < 1e-7
    for alpha in (1e-4, 0.3, 1.0):
        assert np.all(np.isfinite(by_alpha(jnp.array(alpha), wo)))


@pytest.mark.parametrize("kind", KINDS)
def test_float32_stays_close_to_float64(kind: str):
    query = jax.jit(draw_pairs, static_argnums=1)(jax.random.key(3), 4000)
    for roughness in (numbers(Isotropic, 0.02), numbers(Tensor, 0.5, 0.3, -0.2)):
        params = white(kind, roughness)
        single = np.asarray(EVAL(params, query), float)
        with jax.enable_x64(True):
            double = np.asarray(EVAL(*in_double((params, query))))
        # a place among 96 steps is rounded to 1e-5 of one, in which Beckmann's losses fall by powers of ten
        held = double > 1e-6 * double.max()
        np.testing.assert_allclose(single[held], double[held], rtol=1e-3)
        assert np.median(np.abs(single[held] / double[held] - 1)) < 2e-5


def test_gradients_match_finite_differences():
    with jax.enable_x64(True):
        wi, wo = views((0.8, 0.31), (0.2,)), views((0.5, 0.07), (2.0,))
        params = MicrofacetParams(
            Ggx(Tensor(*map(jnp.array, (0.5, 0.3, -0.2)))), Conductor(jnp.full(3, 0.5), jnp.array([3.0, 2.0, 1.0]))
        )
        check_grads(lambda p, i, o: jnp.log(EVAL(p, Query(i, o))), (params, wi, wo), order=1, modes=["rev"], rtol=1e-3)


@pytest.mark.parametrize(
    "fresnel", [Schlick(jnp.array([0.04, 0.5, 0.9])), Dielectric(jnp.array(1.5))], ids=["schlick", "glass"]
)
def test_mean_reflectance_and_albedo(fresnel: Fresnel):
    mean = mean_reflectance(fresnel, 1)
    # Schlick's mean is f0 + (1 - f0) / 21; the dielectric's is that of a finer quadrature
    exact = fresnel.f0 + (1 - fresnel.f0) / 21 if isinstance(fresnel, Schlick) else diffuse_reflectance(fresnel.eta)
    np.testing.assert_allclose(np.broadcast_to(exact, mean.shape), mean, rtol=1e-5)
    params = MicrofacetParams(Ggx(numbers(Isotropic, 0.7)), fresnel)
    wo = spherical(jnp.array(1.1), jnp.array(0.2))
    estimate = directional_albedo(jax.random.key(4), MULTIPLE_SCATTERING, params, wo, samples=50_000)
    got = np.asarray(ALBEDO(params, Query(wo, wo)))
    assert np.all(np.abs(got - estimate.value) < 4 * estimate.standard_error + 1e-4)


def test_f_ms_is_the_series_of_scatterings():
    """mean E of the light escapes each time and each meeting keeps mean F: the sum of F^k E (1 - E)^(k - 2), k >= 2."""
    f0 = 0.6
    params = MicrofacetParams(Ggx(numbers(Isotropic, 1.0)), Schlick(jnp.full(3, f0)))
    lost, mean = float(MEAN(params.distribution)), f0 + (1 - f0) / 21
    series = sum(mean**k * (1 - lost) * lost ** (k - 2) for k in range(2, 60))
    wo = jnp.array([0.0, 0.6, 0.8])
    again = np.asarray(ALBEDO(params, Query(wo, wo))) / float(LOSS(params.distribution, wo))
    np.testing.assert_allclose(again, series, rtol=1e-5)


def test_batches_of_parameters_and_shapes():
    query = jax.tree.map(
        lambda x: x.reshape(2, 5, 3, 3), Query(*jax.jit(draw_pairs, static_argnums=1)(jax.random.key(5), 30)[:2])
    )
    alpha = jax.random.uniform(jax.random.key(6), (2, 5, 3), minval=0.05)
    f0 = jax.random.uniform(jax.random.key(7), (2, 5, 3, 3))
    varying = EVAL(MicrofacetParams(Ggx(Axes(alpha, 0.5 * alpha)), Schlick(f0)), query)
    here = (1, 2, 0)
    one = MicrofacetParams(Ggx(Axes(alpha[here], 0.5 * alpha[here])), Schlick(f0[here]))
    np.testing.assert_allclose(varying[here], EVAL(one, Query(query.wi[here], query.wo[here])), rtol=1e-5)


def test_what_has_no_table_is_refused():
    wo = jnp.array([0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="mean slope"):
        loss(Ggx(numbers(Isotropic, 0.5), jnp.zeros(2)), wo)
    with pytest.raises(ValueError, match="distribution is Isotropic; losses are known of Ggx and Beckmann"):
        mean_loss(numbers(Isotropic, 0.5))
