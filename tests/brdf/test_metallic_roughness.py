"""The glTF material against the specification written out, its two ends, its furnace, and the tests of every lobe."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.metallic_roughness import METALLIC_ROUGHNESS, MetallicRoughnessParams
from jaxbrdf.brdf.microfacet import SEPARABLE_MICROFACET, MicrofacetParams
from jaxbrdf.checks.chi_square import significance_of_each
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.core.fresnel import Schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.ranges import check_ranges
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.metrics.estimate import Estimate
from jaxbrdf.types import Brdf, Query
from tests.brdf import lobes

BASE = (0.9, 0.4, 0.02)
SETS = [(0.5, 0.5), (1.0, 0.01), (0.0, 1.0)]


def params(metallic: float, roughness: float, base: tuple[float, ...] = BASE) -> MetallicRoughnessParams:
    return MetallicRoughnessParams(jnp.array(base), jnp.array(metallic), jnp.array(roughness))


def specified(values: MetallicRoughnessParams, query: Query) -> np.ndarray:
    """Appendix B of the glTF 2.0 specification, formula by formula, in float64."""
    light, view = (np.asarray(w, np.float64) for w in query[:2])
    base, metallic, roughness = (np.asarray(value, np.float64) for value in values)
    half = light + view
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    n_l, n_v, n_h, v_h = light[:, 2], view[:, 2], half[:, 2], np.sum(view * half, -1)
    a2 = roughness**4
    distribution = a2 / (np.pi * (n_h**2 * (a2 - 1) + 1) ** 2)
    visibility = 1 / (n_l + np.sqrt(a2 + (1 - a2) * n_l**2)) / (n_v + np.sqrt(a2 + (1 - a2) * n_v**2))
    specular = (distribution * visibility)[:, None]
    weight = ((1 - np.abs(v_h)) ** 5)[:, None]
    metal = specular * (base + (1 - base) * weight)
    share = 0.04 + (1 - 0.04) * weight
    dielectric = (1 - share) * base / np.pi + share * specular
    return (1 - metallic) * dielectric + metallic * metal


def test_it_is_what_the_specification_says():
    query = lobes.PAIRS(jax.random.key(0), 4000)[0]
    for metallic, roughness in ((0.0, 0.3), (0.6, 0.5), (1.0, 1.0)):
        values = params(metallic, roughness)
        np.testing.assert_allclose(
            lobes.EVAL(METALLIC_ROUGHNESS, values, query), specified(values, query), rtol=2e-4, atol=1e-12
        )


def test_a_pure_metal_is_the_microfacet_lobe():
    query = lobes.pairs(2000, 1)
    metal = MicrofacetParams(Ggx(Isotropic(jnp.array(0.09))), Schlick(jnp.array(BASE)))
    want = lobes.EVAL(SEPARABLE_MICROFACET, metal, query)
    np.testing.assert_allclose(lobes.EVAL(METALLIC_ROUGHNESS, params(1.0, 0.3), query), want, rtol=2e-6)


def test_a_texture_gives_every_query_its_own():
    query = jax.tree.map(lambda x: x.reshape(2, 30, 3), lobes.PAIRS(jax.random.key(2), 60)[0])
    rng = np.random.default_rng(0)
    maps = MetallicRoughnessParams(
        *(jnp.array(rng.uniform(0.1, 1, s), jnp.float32) for s in ((2, 30, 3), (2, 30), (2, 30)))
    )
    drawn = METALLIC_ROUGHNESS.sample(maps, query, jax.random.uniform(jax.random.key(3), (2, 30, 3)))
    one, at = jax.tree.map(lambda x: x[1, 7], maps), Query(query.wi[1, 7], query.wo[1, 7])
    f, pdf = lobes.EVAL(METALLIC_ROUGHNESS, maps, query), METALLIC_ROUGHNESS.pdf(maps, query)
    assert drawn.weight.shape == (2, 30, 3)
    np.testing.assert_allclose(f[1, 7], METALLIC_ROUGHNESS.eval(one, at), rtol=1e-6)
    np.testing.assert_allclose(pdf[1, 7], METALLIC_ROUGHNESS.pdf(one, at), rtol=1e-6)


@pytest.mark.parametrize(("metallic", "roughness"), SETS)
def test_common_checks(metallic: float, roughness: float):
    values = params(metallic, roughness)
    check_ranges(values)
    lobes.assert_finite_and_reciprocal(METALLIC_ROUGHNESS, values)
    lobes.assert_finite_and_reciprocal(METALLIC_ROUGHNESS, params(metallic, roughness, (0.0, 0.0, 0.0)))
    lobes.assert_float32_is_enough(METALLIC_ROUGHNESS, values)


def test_sampler():
    level = significance_of_each(0.01, 2 * len(lobes.VIEWERS))
    for values in (params(0.3, 0.5), params(0.9, 1.0)):
        lobes.assert_sampler_is_exact(METALLIC_ROUGHNESS, values, level, within=1e-4)
        lobes.assert_draws_carry_the_albedo(METALLIC_ROUGHNESS, values)


def white_albedo(metallic: float, roughness: float, theta: float) -> Estimate:
    values = params(metallic, roughness, (1.0, 1.0, 1.0))
    return directional_albedo(jax.random.key(1), METALLIC_ROUGHNESS, values, lobes.viewer(theta), samples=20_000)


@pytest.mark.parametrize("roughness", [0.01, 0.5, 1.0])
def test_a_white_metal_gains_nothing(roughness: float):
    for theta in (0.0, 1.0, 1.56):
        albedo = white_albedo(1.0, roughness, theta)
        assert np.all(albedo.value <= 1 + 1e-5 + 4 * albedo.standard_error), (theta, albedo)


def test_a_white_body_gains_as_documented():
    """What the facets take of it is reckoned by cos_d, which is not grazing for most light at a grazing view."""
    gains = [white_albedo(0.0, 0.01, theta).value[0] for theta in (0.0, 1.0, 1.56)]
    np.testing.assert_allclose(gains, [1.0, 1.016, 1.83], atol=0.04)


def test_draws_vary_less_than_the_cosines():
    values, wo = params(0.2, 0.3), lobes.viewer(0.9)
    own = directional_albedo(jax.random.key(0), METALLIC_ROUGHNESS, values, wo)
    plain = directional_albedo(jax.random.key(0), Brdf(METALLIC_ROUGHNESS.eval), values, wo)
    assert np.all(own.standard_error < 0.5 * plain.standard_error)
