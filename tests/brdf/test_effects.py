"""Materials as lists of effects: what is left out costs nothing and changes nothing, and the stack is a good BRDF."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.effects import EFFECTS, STACK, Coat, Film, MultipleScattering, compose
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, MicrofacetParams, ggx
from jaxbrdf.brdf.multiple_scattering import MULTIPLE_SCATTERING
from jaxbrdf.brdf.oren_nayar import OREN_NAYAR, OrenNayarParams
from jaxbrdf.brdf.sheen import SHEEN, SheenParams
from jaxbrdf.brdf.substrate import SUBSTRATE, SubstrateParams
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.core.fresnel import Conductor, Dielectric, Schlick
from jaxbrdf.core.ggx import Ggx
from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.types import Brdf, Query
from tests.brdf import lobes

COLOUR = (0.6, 0.3, 0.1)
BODY = OrenNayarParams(jnp.array(COLOUR), jnp.array(0.4))
INDEX = Conductor(jnp.array([0.223, 0.428, 1.335]), jnp.array([3.204, 2.460, 1.872]))
GLOSS = Ggx(Isotropic(jnp.array(0.3)))
METAL = MicrofacetParams(GLOSS, INDEX)


def sheen(amount: float) -> SheenParams:
    return SheenParams(jnp.full(3, amount), jnp.array(0.5))


def coat(eta: float) -> Coat:
    return Coat(Ggx(Isotropic(jnp.array(0.1))), jnp.array(eta))


def film(thickness: float) -> Film:
    return Film(jnp.array(thickness), jnp.array(1.5))


# each effect on others: the list with it, the same with it at its neutral value, and without it
SHINY = MicrofacetParams(Ggx(Isotropic(jnp.array(1e-4))), INDEX)
NEUTRAL: dict[str, tuple[tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]]] = {
    "sheen": ((BODY, sheen(0.5)), (BODY, sheen(0.0)), (BODY,)),
    "coat": ((BODY, coat(1.5), sheen(0.2)), (BODY, coat(1.0), sheen(0.2)), (BODY, sheen(0.2))),
    "film": ((METAL, film(400.0)), (METAL, film(0.0)), (METAL,)),
    "multiple scattering": ((METAL, MultipleScattering()), (SHINY, MultipleScattering()), (SHINY,)),
    "body": ((LambertParams(jnp.array(COLOUR)), METAL), (LambertParams(jnp.zeros(3)), METAL), (METAL,)),
    "facets": (
        (SubstrateParams(jnp.array(COLOUR), jnp.array(1.5)), MicrofacetParams(GLOSS, Dielectric(jnp.array(1.5)))),
        (SubstrateParams(jnp.array(COLOUR), jnp.array(1.5)), MicrofacetParams(GLOSS, Dielectric(jnp.array(1.0)))),
        (SubstrateParams(jnp.array(COLOUR), jnp.array(1.5)),),
    ),
}


def steep(query: Query) -> Query:
    """Pairs at which facets of roughness 1e-4 shade nothing: at an angle like their slopes the smoothest still do."""
    kept = np.flatnonzero((query.wi[:, 2] > 0.5) & (query.wo[:, 2] > 0.5))
    return Query(query.wi[kept], query.wo[kept])


MANY = (METAL, MultipleScattering(), coat(1.4), sheen(0.3))


def price(brdf: Brdf, params: Any) -> float:
    """Floating-point operations of the compiled value for 1000 queries."""
    query = Query(jnp.ones((1000, 3)), jnp.ones((1000, 3)))
    return jax.jit(brdf.eval).lower(params, query).compile().cost_analysis()["flops"]


@pytest.mark.parametrize("name", NEUTRAL)
def test_an_effect_left_out_costs_nothing_and_is_the_neutral_one(name: str):
    whole, neutral, without = NEUTRAL[name]
    assert price(*compose(*without)) < price(*compose(*whole))
    query = lobes.pairs(3000, 0)
    if name == "multiple scattering":
        query = steep(query)
    want = lobes.EVAL(*compose(*without), query)
    np.testing.assert_allclose(lobes.EVAL(*compose(*neutral), query), want, rtol=1e-6, atol=1e-7)
    assert np.mean(np.abs(lobes.EVAL(*compose(*whole), query) - lobes.EVAL(*compose(*neutral), query))) > 1e-3


@pytest.mark.parametrize(
    ("brdf", "params"),
    [(OREN_NAYAR, BODY), (MICROFACET, METAL), (SHEEN, sheen(0.5))],
    ids=["body", "metal", "sheen"],
)
def test_a_single_effect_is_its_lobe(brdf: Brdf, params: Any):
    alone, effects = compose(params)
    assert price(alone, effects) == price(brdf, params)
    query = lobes.pairs(500, 1)
    u = jax.random.uniform(jax.random.key(0), query.wo.shape)
    np.testing.assert_array_equal(lobes.EVAL(alone, effects, query), lobes.EVAL(brdf, params, query))
    for one, other in zip(alone.sample(effects, query, u), brdf.sample(params, query, u), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_metal_with_multiple_scattering_costs_what_the_sum_by_hand_costs():
    def by_hand(params: MicrofacetParams, query: Query) -> jax.Array:
        return MULTIPLE_SCATTERING.eval(params, query) + MICROFACET.eval(params, query)

    brdf, effects = compose(METAL, MultipleScattering())
    assert price(brdf, effects) == price(Brdf(by_hand), METAL)
    query = lobes.pairs(500, 2)
    np.testing.assert_allclose(lobes.EVAL(brdf, effects, query), by_hand(METAL, query), rtol=1e-6)


def test_what_lies_on_top_dims_what_is_beneath_both_ways():
    body, query = LambertParams(jnp.array(COLOUR)), lobes.pairs(500, 3)
    f = lobes.EVAL(*compose(body, sheen(0.7)), query)
    passed = [1.0 - SHEEN.albedo(sheen(0.7), Query(w, w)) for w in query[:2]]
    want = SHEEN.eval(sheen(0.7), query) + passed[0] * passed[1] * LAMBERT.eval(body, query)
    np.testing.assert_allclose(f, want, rtol=1e-5)


def test_plastic_is_substrate_and_facets():
    eta, query = jnp.array(1.5), lobes.pairs(500, 4)
    body, surface = SubstrateParams(jnp.array(COLOUR), eta), MicrofacetParams(GLOSS, Dielectric(eta))
    want = SUBSTRATE.eval(body, query) + MICROFACET.eval(surface, query)
    np.testing.assert_allclose(lobes.EVAL(*compose(body, surface), query), want, rtol=1e-6)


def test_draws_carry_the_light():
    lobes.assert_draws_carry_the_albedo(*compose(BODY, coat(1.5), sheen(0.3)), least=1e-3)


def test_black_at_the_viewers_angle_is_still_drawn():
    black = ggx(jnp.array(0.3), jnp.array(0.3), Schlick(jnp.zeros(3)))
    brdf, effects = compose(LambertParams(jnp.zeros(3)), black)
    drawn = directional_albedo(jax.random.key(0), brdf, effects, lobes.viewer(0.0))
    want = lobes.albedo_by_quadrature(brdf, effects, 0.0)
    assert np.all(np.abs(drawn.value - want) < 4 * drawn.standard_error + 1e-6)
    assert np.all(want > 0)


WHITE = LambertParams(jnp.ones(3))
STACKS = {
    "coat": (WHITE, coat(1.5)),
    "sheen": (WHITE, sheen(1.0)),
    "both": (WHITE, coat(1.3), sheen(1.0)),
    "metal": (MicrofacetParams(GLOSS, Schlick(jnp.ones(3))), MultipleScattering(), coat(1.5)),
}


@pytest.mark.parametrize("name", STACKS)
def test_white_furnace_gains_nothing(name: str):
    brdf, effects = compose(*STACKS[name])
    for theta in (0.0, 0.8, 1.3, 1.55):
        albedo = directional_albedo(jax.random.key(1), brdf, effects, lobes.viewer(theta))
        # the fits of sheen's albedo and of the facets' loss are good to 2e-3
        assert np.all(albedo.value <= 1 + 2e-3 + 4 * albedo.standard_error), (theta, albedo)


def test_a_film_colours_a_dielectric_too():
    grey = MicrofacetParams(GLOSS, Dielectric(jnp.array(1.5)))
    query = lobes.pairs(500, 5)
    bare, none = lobes.EVAL(*compose(grey), query), lobes.EVAL(*compose(grey, film(0.0)), query)
    np.testing.assert_allclose(none, bare, rtol=1e-4, atol=1e-7)
    soap = lobes.EVAL(*compose(grey, Film(jnp.array(300.0), jnp.array(2.0))), query)
    assert np.max(np.ptp(np.asarray(soap), axis=-1)) > 0.01


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ((), "effects is empty"),
        ((BODY, 3.0), r"effects\[1\] is a float; it must be one of Coat, .*SubstrateParams"),
        ((None,), r"effects\[0\] is a NoneType"),
        ((BODY, film(300.0)), "Film must follow microfacets"),
        ((MultipleScattering(),), "MultipleScattering must follow microfacets"),
        ((BODY, coat(1.5), film(300.0)), "Film must follow microfacets"),
        ((ggx(jnp.array(0.1), jnp.array(0.1), Schlick(jnp.ones(3))), film(300.0)), "Conductor or Dielectric"),
    ],
)
def test_wrong_lists_are_refused(effects: tuple[Any, ...], message: str):
    with pytest.raises(ValueError, match=message):
        compose(*effects)


def test_every_kind_is_tested():
    tested = {type(effect) for lists in NEUTRAL.values() for each in lists for effect in each} | {type(WHITE)}
    assert tested == set(EFFECTS)
    assert compose(*MANY)[0] is STACK
