"""The principled BRDF against Mitsuba's plugin, its neutral values, its price, and what every lobe is tested for."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.check_brdfs_against_mitsuba import coat_spread, draw_queries, random_principled, relative
from jaxbrdf.brdf.principled import PRINCIPLED, PrincipledParams, index_of_specular
from jaxbrdf.checks.chi_square import significance_of_each
from jaxbrdf.checks.furnace import directional_albedo
from jaxbrdf.core.ranges import check_ranges
from jaxbrdf.types import Query
from tests.brdf import lobes
from tests.brdf.mitsuba_bsdfs import one_by_one

EFFECTS = ("metallic", "anisotropic", "spec_tint", "sheen", "flatness", "clearcoat")
ALL = dict.fromkeys((*EFFECTS, "sheen_tint", "clearcoat_gloss"), 0.4)
SETS = 24


def params(**values: float) -> PrincipledParams:
    """A blue-green body of roughness 0.4 and index 1.5 with these values."""
    chosen = {"roughness": 0.4, "eta": 1.5, "base_color": (0.1, 0.4, 0.7)} | values
    return PrincipledParams(**{name: jnp.array(value) for name, value in chosen.items()})


PDF = jax.jit(PRINCIPLED.pdf)


def plugin(row: PrincipledParams) -> dict:
    """Mitsuba's dictionary for one set of parameters."""
    values = {name: float(value) for name, value in row._asdict().items() if name != "base_color" and value is not None}
    base = {"type": "rgb", "value": np.asarray(row.base_color).tolist()}
    return {"type": "principled", "base_color": base} | values


def test_it_is_mitsubas(mitsuba_rgb):
    """Random parameters, 30 pairs with each; the experiment has 1e5 of both."""
    query, drawn = draw_queries(30 * SETS, 2), random_principled(SETS, 3)
    repeated = jax.tree.map(lambda x: jnp.repeat(x, 30, axis=0), drawn)
    mine = np.asarray(lobes.EVAL(PRINCIPLED, repeated, query)), np.asarray(PDF(repeated, query))
    rows = [jax.tree.map(lambda x, i=i: x[i], drawn) for i in range(SETS)]
    parts = [Query(query.wi[i : i + 30], query.wo[i : i + 30]) for i in range(0, 30 * SETS, 30)]
    answers = [one_by_one(mitsuba_rgb, plugin(row), part) for row, part in zip(rows, parts, strict=True)]
    theirs = [np.concatenate(column) for column in zip(*answers, strict=True)]
    # where the plugin's coat cancels in float32, it is its own rounding that shows
    kept = coat_spread(repeated, query) > 1e-3
    assert kept.mean() > 0.8
    for one, other in zip(mine, theirs, strict=True):
        error = relative(one, other)[kept]
        assert np.median(error) < 1e-6
        assert np.quantile(error, 0.99) < 2e-4


@pytest.mark.parametrize("effects", [{}, {"metallic": 1.0}, {"sheen": 1.0}, {"clearcoat": 1.0}], ids=str)
def test_it_is_mitsubas_with_few_effects(effects: dict[str, float], mitsuba_rgb):
    query = draw_queries(60, 4)
    theirs = one_by_one(mitsuba_rgb, plugin(params(**effects)), query)
    np.testing.assert_allclose(lobes.EVAL(PRINCIPLED, params(**effects), query), theirs.value, rtol=1e-4)
    # the plugin's |wi . wh| / |wo . wh| has the directions' own rounding over cos_d
    np.testing.assert_allclose(PDF(params(**effects), query), theirs.density, rtol=1e-3)


def test_index_of_specular_is_mitsubas(mitsuba_rgb):
    query, specular = draw_queries(20, 5), 0.3
    bare = plugin(params())
    del bare["eta"]
    theirs = one_by_one(mitsuba_rgb, bare | {"specular": specular}, query)
    mine = lobes.EVAL(PRINCIPLED, params(eta=index_of_specular(jnp.array(specular))), query)
    np.testing.assert_allclose(mine, theirs.value, rtol=1e-4)
    assert float(index_of_specular(jnp.array(0.5))) == pytest.approx(1.5)


def compiled(values: PrincipledParams, function=PRINCIPLED.eval):
    query = lobes.pairs(1000, 0)
    return jax.jit(function).lower(values, query).compile()


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_left_out_costs_nothing_and_is_the_neutral_one(effect: str):
    query, rest = lobes.pairs(1000, 0), ALL | {"metallic": 0.4}
    without = {name: value for name, value in rest.items() if name != effect}
    whole, less = compiled(params(**rest)), compiled(params(**without))
    assert less.cost_analysis()["flops"] < whole.cost_analysis()["flops"]
    np.testing.assert_allclose(less(params(**without), query), whole(params(**rest | {effect: 0.0}), query), rtol=1e-6)


@pytest.mark.parametrize("effect", ["metallic", "anisotropic", "clearcoat"])
def test_an_effect_left_out_is_not_drawn(effect: str):
    query, without = lobes.pairs(1000, 0), {name: value for name, value in ALL.items() if name != effect}
    np.testing.assert_allclose(PDF(params(**without), query), PDF(params(**ALL | {effect: 0.0}), query), rtol=1e-6)
    less, whole = (compiled(params(**values), PRINCIPLED.pdf) for values in (without, ALL))
    assert less.cost_analysis()["flops"] < whole.cost_analysis()["flops"]


def test_tints_and_gloss_at_zero_are_their_absence():
    query = lobes.pairs(1000, 0)
    values = ALL | {"sheen_tint": 0.0, "clearcoat_gloss": 0.0}
    without = {name: value for name, value in ALL.items() if name not in ("sheen_tint", "clearcoat_gloss")}
    want = lobes.EVAL(PRINCIPLED, params(**values), query)
    np.testing.assert_allclose(lobes.EVAL(PRINCIPLED, params(**without), query), want, rtol=1e-6)


def test_published_values():
    """At the normal base / pi + F0 / (4 pi alpha^2), at grazing retroreflection base / pi (1/2 + 2 roughness)^2.

    (Burley 2012, sections 5.3 and 5.4.)
    """
    up = jnp.array([0.0, 0.0, 1.0])
    f = lobes.EVAL(PRINCIPLED, params(base_color=(0.5, 0.5, 0.5), roughness=1.0), Query(up, up))
    np.testing.assert_allclose(f, 0.5 / np.pi + 0.04 / (4 * np.pi), rtol=1e-6)
    low = jnp.array([1.0, 0.0, 1e-6])
    f = lobes.EVAL(PRINCIPLED, params(base_color=(0.5, 0.5, 0.5), roughness=0.8, eta=1.0), Query(low, low))
    np.testing.assert_allclose(f, 0.5 / np.pi * 2.1**2, rtol=2e-5)


HARD = {
    "all": ALL,
    "sharp": ALL | {"roughness": 0.01, "anisotropic": 1.0, "clearcoat_gloss": 1.0},
    "rough metal": ALL | {"roughness": 1.0, "anisotropic": 1.0, "metallic": 1.0, "base_color": (1.0, 1.0, 1.0)},
    "black": {"base_color": (0.0, 0.0, 0.0), "spec_tint": 1.0, "sheen": 1.0, "sheen_tint": 1.0, "eta": 1.0},
}


@pytest.mark.parametrize("name", HARD)
def test_hard_cases(name: str):
    check_ranges(params(**HARD[name]))
    lobes.assert_finite_and_reciprocal(PRINCIPLED, params(**HARD[name]), within=4e-6)


def test_float32_is_enough():
    lobes.assert_float32_is_enough(PRINCIPLED, params(**HARD["sharp"]))


def test_sampler():
    lobes.assert_sampler_is_exact(PRINCIPLED, params(**ALL), significance_of_each(0.01, 3), within=1e-4)
    isotropic = {name: value for name, value in ALL.items() if name not in ("anisotropic", "clearcoat_gloss")}
    lobes.assert_draws_carry_the_albedo(PRINCIPLED, params(**isotropic), least=1e-3)


def test_a_white_one_gains_as_documented():
    values = params(base_color=(1.0, 1.0, 1.0), roughness=1.0)
    gains = [directional_albedo(jax.random.key(0), PRINCIPLED, values, lobes.viewer(t)).value[0] for t in (0.0, 1.5)]
    np.testing.assert_allclose(gains, [1.05, 1.47], atol=0.02)
