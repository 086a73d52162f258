"""The position-free estimator against particles traced through the stack, closed forms, reciprocity and the furnace."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from experiments.check_position_free import STACKS, params_of, z_scores
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams
from jaxbrdf.brdf.position_free import StackParams, position_free
from jaxbrdf.brdf.rough_interface import InterfaceParams
from jaxbrdf.brdf.substrate import SUBSTRATE, SubstrateParams
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.fresnel import Schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Brdf, Query

ESTIMATE = jax.jit(position_free(LAMBERT).estimate, static_argnames="samples")
METAL_EVAL = jax.jit(position_free(MICROFACET).noisy_eval)
SAMPLES = 4096
ALBEDO = jnp.array([0.8, 0.5, 1.0])
WI = spherical(jnp.array([0.1, 0.6, 1.2, 0.9]), jnp.array([0.0, 0.8, 2.0, -2.0]))
WO = spherical(jnp.array([1.1, 0.4, 0.3, 0.9]), jnp.full(4, 1.0))


def interface(alpha: float, eta: float) -> InterfaceParams:
    return InterfaceParams(Ggx(Isotropic(jnp.array(alpha))), jnp.array(eta))


@pytest.mark.parametrize("name", ["rough coat, gold", "hazy coat, clay", "two coats, clay"])
def test_matches_traced_particles(name: str):
    z = z_scores(STACKS[name], seed=11, particles=150_000, viewers=1024)
    assert stats.chi2.sf(np.square(z).sum(), z.size) > 1e-3


def test_a_smooth_interface_over_lambert_is_the_closed_form():
    stack = StackParams((interface(1e-3, 1.5),), (None,), LambertParams(ALBEDO))
    found = ESTIMATE(jax.random.key(1), stack, Query(WI, WO), samples=SAMPLES)
    want = SUBSTRATE.eval(SubstrateParams(ALBEDO, jnp.array(1.5)), Query(WI, WO))
    assert np.all(np.abs(found.value - want) < 4 * found.standard_error)
    assert np.all(found.standard_error < 0.04 * want)


def test_a_smooth_interface_of_index_one_is_not_there():
    stack = StackParams((interface(1e-4, 1.0),), (None,), LambertParams(ALBEDO))
    found = ESTIMATE(jax.random.key(2), stack, Query(WI, WO), samples=SAMPLES)
    np.testing.assert_allclose(found.value, LAMBERT.eval(stack.base, Query(WI, WO)), rtol=1e-5)
    assert np.all(found.standard_error < 1e-6)


def test_reciprocity():
    _, stack = params_of(STACKS["rough coat, clay"])
    there = ESTIMATE(jax.random.key(3), stack, Query(WI, WO), samples=SAMPLES)
    back = ESTIMATE(jax.random.key(4), stack, Query(WO, WI), samples=SAMPLES)
    error = np.hypot(there.standard_error, back.standard_error)
    assert np.all(np.abs(there.value - back.value) < 4 * error)


def test_below_the_horizon_nothing_is_seen():
    stack = StackParams((interface(0.3, 1.5),), (None,), LambertParams(ALBEDO))
    for query in (Query(-WI, WO), Query(WI, -WO), Query(-WI, -WO)):
        assert np.all(ESTIMATE(jax.random.key(5), stack, query, samples=SAMPLES).value == 0)


@pytest.mark.parametrize(("alpha", "least"), [(0.02, 0.985), (0.6, 0.5)])
def test_white_furnace(alpha: float, least: float):
    """A white base under a lossless coat returns all but what facets catch from each other."""
    white = MicrofacetParams(Ggx(Isotropic(jnp.array(0.02))), Schlick(jnp.ones(3)))
    stack = StackParams((interface(alpha, 1.5),), (None,), white)
    rng = np.random.default_rng(6)
    for theta in (0.0, 0.7):
        wo = jnp.array([np.sin(theta), 0.0, np.cos(theta)], jnp.float32)
        wi, density = drawn_lights(rng, wo, 16384)
        f = METAL_EVAL(jax.random.key(7), stack, Query(wi, jnp.broadcast_to(wo, wi.shape)))
        light = np.asarray(f[:, 0] * jnp.maximum(wi[:, 2], 0.0), float) / density
        error = light.std() / np.sqrt(len(light))
        assert least - 4 * error < light.mean() < 1 + 4 * error


def drawn_lights(rng: np.random.Generator, wo: jax.Array, count: int) -> tuple[jax.Array, np.ndarray]:
    """Lights by a mixture of the cosine and the lobe of a mirror rougher than the smooth stack, and its density."""
    wide = MicrofacetParams(Ggx(Isotropic(jnp.array(0.06))), Schlick(jnp.ones(3)))
    u = jnp.asarray(rng.random((count, 3)), jnp.float32)
    viewer = jnp.broadcast_to(wo, (count, 3))
    mirrored = MICROFACET.sample(wide, Query(viewer, viewer), u).wi
    wi = jnp.where((jnp.arange(count) % 2 == 0)[:, None], mirrored, square_to_cosine(u[:, 1:]))
    density = 0.5 * MICROFACET.pdf(wide, Query(wi, viewer)) + 0.5 * jnp.maximum(wi[:, 2], 0.0) / jnp.pi
    return wi, np.where(wi[:, 2] > 0, density, 1.0)


def test_refuses_what_is_no_stack():
    with pytest.raises(ValueError, match="no sample"):
        position_free(Brdf(LAMBERT.eval))
    stack = StackParams((interface(0.3, 1.5),), (), LambertParams(ALBEDO))
    with pytest.raises(ValueError, match="1 interfaces and 0 media"):
        position_free(LAMBERT).noisy_eval(jax.random.key(8), stack, Query(WI, WO))
