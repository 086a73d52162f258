"""The fitted proxy: it finds a proxy's own numbers, matches its density everywhere, and is smooth in the viewer."""

from __future__ import annotations

from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.builtin import MATERIALS
from jaxbrdf.brdf.proposed import propose
from jaxbrdf.checks.chi_square import chi_square, significance_of_each
from jaxbrdf.checks.partition import half_vector
from jaxbrdf.core.directions import spherical
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.fit.proxy import ProxyFit, fit_proxy
from jaxbrdf.sampling.conditional import memory
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.sampling.proposal import COSINE
from jaxbrdf.sampling.proxy import VISIBLE_PROXY, ProxyParams
from jaxbrdf.sampling.view_frame import from_view, to_view
from jaxbrdf.sampling.view_proxy import VISIBLE_VIEW_PROXY, ViewProxy, proxy_at
from jaxbrdf.types import Brdf, Material, Query

QUICK = ProxyFit(elevations=8, steps=150)
SEEDS, VIEWERS = (0, 1, 2), (0.0, 0.61, 1.5)


@pytest.fixture(scope="module")
def ceramic() -> tuple[Material, ViewProxy]:
    material = MATERIALS["glazed-ceramic"]()
    return material, fit_proxy(material.brdf.eval, material.params, config=QUICK)


def test_the_interpolated_sampler_agrees_with_its_density(ceramic: tuple[Material, ViewProxy]):
    material = propose(ceramic[0], VISIBLE_VIEW_PROXY, ceramic[1])
    level = significance_of_each(0.01, len(SEEDS) * len(VIEWERS))
    for seed, theta in product(SEEDS, VIEWERS):
        wo = spherical(jnp.array(theta), jnp.array(2.5))
        # between the widths of the ceramic's glaze and of its body
        cells = half_vector(tuple(np.asarray(wo, float)), 0.15, 0.15)
        result = chi_square(jax.random.key(seed), material.brdf, material.params, wo, partition=cells, samples=50_000)
        assert result.p_value > level, (theta, result)


def noise(material: Material, wo: jax.Array) -> float:
    """Variance over squared mean of a draw's weight for a viewer: zero where light is drawn as it is reflected."""
    u = jax.random.uniform(jax.random.key(4), (20_000, 3))
    viewer = jnp.broadcast_to(wo, (20_000, 3))
    weight = np.asarray(jax.jit(material.brdf.sample)(material.params, Query(viewer, viewer), u).weight[:, 0], float)
    return float(np.var(weight[weight > 0]) / np.mean(weight[weight > 0]) ** 2)


def test_a_proxy_finds_itself():
    """A reflectance whose light is a proxy's density, the same for all views, is drawn by the fitted one."""
    truth = ProxyParams(*map(jnp.float32, (0.4, 0.2, 0.0, 0.6, 0.15, 0.3, 0.3, 0.1, 0.05)))

    def evaluate(params: ProxyParams, query: Query) -> jax.Array:
        density = VISIBLE_PROXY.pdf(params, to_view(query.wi, query.wo), to_view(query.wo, query.wo))
        return safe_divide(density, query.wi[..., 2])[..., None] * jnp.ones_like(query.wi)

    fitted = fit_proxy(evaluate, truth, config=ProxyFit(elevations=4, steps=300))
    material = propose(Material("proxy", Brdf(evaluate), truth, True), VISIBLE_VIEW_PROXY, fitted)
    for theta in (0.3, 0.8, 1.2):
        assert noise(material, spherical(jnp.array(theta), jnp.array(1.0))) < 0.02


def test_a_fitted_proxy_has_less_noise_than_the_cosine(ceramic: tuple[Material, ViewProxy]):
    material, fitted = ceramic
    wo = square_to_cosine(jax.random.uniform(jax.random.key(3), (20_000, 2)))
    u = jax.random.uniform(jax.random.key(4), (20_000, 3))
    square = {}
    for name, (proposal, params) in {"cosine": (COSINE, None), "proxy": (VISIBLE_VIEW_PROXY, fitted)}.items():
        drawn = propose(material, proposal, params)
        weight = np.asarray(jax.jit(drawn.brdf.sample)(drawn.params, Query(wo, wo), u).weight, float)
        square[name] = np.mean(weight**2)
    assert square["proxy"] < 0.2 * square["cosine"]
    assert memory(fitted) == 8 * 9 * 4


def test_the_viewers_frame_has_its_inverse():
    w, wo = square_to_cosine(jax.random.uniform(jax.random.key(5), (2, 1000, 2)))
    np.testing.assert_allclose(from_view(to_view(w, wo), wo), w, atol=3e-7)
    np.testing.assert_allclose(to_view(wo, wo)[:, 1], 0.0, atol=1e-7)
    normal = jnp.array([[0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(from_view(w[:1], normal), w[:1])


def test_nodes_are_met_and_azimuths_wrap():
    nodes = jnp.asarray(np.random.default_rng(0).normal(size=(3, 4, 9)), jnp.float32)
    proxy = ViewProxy(nodes)
    theta, phi = np.pi / 6 * 2, 2 * np.pi / 3 * 2
    at = proxy_at(proxy, spherical(jnp.float32(theta), jnp.float32(phi))[None])
    alone = proxy_at(ViewProxy(nodes[2:3]), spherical(jnp.float32(theta), jnp.float32(0.0))[None])
    np.testing.assert_allclose(np.stack(at), np.stack(alone), rtol=1e-4, atol=1e-5)
    below, above = (proxy_at(proxy, spherical(jnp.array(0.7), jnp.array(a))[None]) for a in (-1e-6, 1e-6))
    np.testing.assert_allclose(np.stack(below), np.stack(above), rtol=1e-3, atol=1e-4)


def test_gradients_by_nodes_and_directions_are_finite(ceramic: tuple[Material, ViewProxy]):
    wi, wo = square_to_cosine(jax.random.uniform(jax.random.key(6), (2, 500, 2)))
    wo = wo.at[0].set(jnp.array([0.0, 0.0, 1.0])).at[1].set(jnp.array([1.0, 0.0, 1e-7]))
    total = jax.jit(jax.grad(lambda p, i, o: jnp.sum(VISIBLE_VIEW_PROXY.pdf(p, i, o)), argnums=(0, 1, 2)))
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(total(ceramic[1], wi, wo)))
