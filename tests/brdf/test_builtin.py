"""The named materials: every one passes every check; the composite's mixture; numbers from published metals."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.builtin import MATERIALS
from jaxbrdf.brdf.composite import CompositeParams, composite
from jaxbrdf.brdf.lambert import LAMBERT, LambertParams
from jaxbrdf.brdf.microfacet import MICROFACET, ggx
from jaxbrdf.core.fresnel import Schlick
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Brdf, Query

# the lobes' own width, or for the ceramic one between its glaze and its body
SPREAD = {"gold": (0.2, 0.2), "brushed-aluminium": (0.08, 0.35), "glazed-ceramic": (0.15, 0.15)}
VIEWERS = (0.0, 0.8, 1.4)


def draw_queries(seed: int) -> Query:
    return jax.jit(draw_weighted, static_argnums=1)(jax.random.key(seed), 4000)[0]


def turned(w: jax.Array, angle: float) -> jax.Array:
    c, s = np.cos(angle), np.sin(angle)
    return w @ jnp.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], w.dtype)


@pytest.mark.parametrize("name", MATERIALS)
def test_isotropy_is_as_declared(name: str):
    material = MATERIALS[name]()
    query, evaluate = draw_queries(4), jax.jit(material.brdf.eval)
    f = evaluate(material.params, query)
    g = evaluate(material.params, Query(turned(query.wi, 0.9), turned(query.wo, 0.9)))
    unchanged = np.mean(np.abs(f - g) <= 1e-3 * np.abs(f))
    assert unchanged > 0.99 if material.isotropic else unchanged < 0.5


def test_metals_have_their_published_reflectance():
    """Normal-incidence colour of the measured spectra under D65, linear Rec.709; gold's red would be 1.038."""
    reflectance = {n: MATERIALS[n]().params.fresnel.reflectance(jnp.array(1.0)) for n in ("gold", "brushed-aluminium")}
    np.testing.assert_allclose(reflectance["gold"], [0.999, 0.728, 0.365], atol=2e-3)
    np.testing.assert_allclose(reflectance["brushed-aluminium"], [0.907, 0.916, 0.922], atol=2e-3)


def test_a_composite_is_its_lobes_sum_and_mixture():
    shiny = ggx(jnp.array(0.2), jnp.array(0.4), Schlick(jnp.array([0.04, 0.04, 0.04])))
    matt = LambertParams(jnp.array([0.5, 0.2, 0.1]))
    both, params = composite(LAMBERT, MICROFACET), CompositeParams((matt, shiny), jnp.array([3.0, 1.0]))
    query = draw_queries(5)
    want_f = LAMBERT.eval(matt, query) + jax.jit(MICROFACET.eval)(shiny, query)
    want_pdf = 0.75 * LAMBERT.pdf(matt, query) + 0.25 * jax.jit(MICROFACET.pdf)(shiny, query)
    np.testing.assert_allclose(jax.jit(both.eval)(params, query), want_f, rtol=1e-6)
    np.testing.assert_allclose(jax.jit(both.pdf)(params, query), want_pdf, rtol=1e-5)


def test_a_composite_refuses_a_lobe_without_sampler():
    with pytest.raises(ValueError, match="no sample"):
        composite(LAMBERT, Brdf(MICROFACET.eval))
