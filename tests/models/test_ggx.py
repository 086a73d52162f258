"""The GGX model: the sum it says, its checks, and parameters that a fit finds again."""

from __future__ import annotations

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, ggx
from jaxbrdf.checks.chi_square import chi_square, significance_of_each
from jaxbrdf.checks.finite import find_faults
from jaxbrdf.checks.partition import polar
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Schlick
from jaxbrdf.core.roughness import Isotropic, Turned
from jaxbrdf.models.ggx import BareGgxConfig, GgxConfig, GgxLobe, GgxLobesParams, TwoGgxConfig, ggx_lobes, start_ggx
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Brdf

ALBEDO, F0 = jnp.array([0.3, 0.2, 0.1]), jnp.array([0.05, 0.06, 0.5])
ONE = GgxLobesParams(ALBEDO, (GgxLobe(F0, Isotropic(jnp.array(0.2))),))
TWO = GgxLobesParams(
    None,
    (
        GgxLobe(F0, Turned(jnp.array(0.1), jnp.array(0.4), jnp.array(0.0))),
        GgxLobe(0.5 * F0, Turned(jnp.array(0.5), jnp.array(0.2), jnp.array(0.9))),
    ),
)


@cache
def model(lobes: int) -> Brdf:
    return ggx_lobes(GgxConfig() if lobes == 1 else TwoGgxConfig(isotropic=False, diffuse=False))


def test_it_is_the_sum_of_its_lobes():
    query = draw_weighted(jax.random.key(0), 2000)[0]
    specular = jax.jit(MICROFACET.eval)(ggx(jnp.array(0.2), jnp.array(0.2), Schlick(F0)), query)
    want = LAMBERT.eval(LambertParams(ALBEDO), query) + specular
    np.testing.assert_allclose(jax.jit(model(1).eval)(ONE, query), want, rtol=1e-6)


@pytest.mark.parametrize(("lobes", "params"), [(1, ONE), (2, TWO)])
def test_values_gradients_and_sampler_hold(lobes: int, params: GgxLobesParams):
    assert find_faults(model(lobes), params) == []
    for theta in (0.3, 1.2):
        wo = spherical(jnp.array(theta), jnp.array(0.7))
        found = chi_square(jax.random.key(1), model(lobes), params, wo, partition=polar(spread=0.5))
        assert found.p_value > significance_of_each(0.01, 4)


@pytest.mark.parametrize("config", [GgxConfig(), TwoGgxConfig(isotropic=False), BareGgxConfig()])
def test_starts_are_valid_and_differ(config: GgxConfig):
    starts = jax.vmap(lambda key: start_ggx(key, config))(jax.random.split(jax.random.key(0), 100))
    assert len(starts.lobes) == config.lobes
    assert (starts.albedo is None) == (not config.diffuse)
    alpha = np.asarray(jax.tree.leaves(starts.lobes[0].roughness)[0])
    assert alpha.min() < 5e-3
    assert alpha.max() > 0.5
