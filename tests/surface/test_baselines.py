"""What every classical prefilter keeps to: flat maps, finite extremes, energy of metals, reciprocity, its sampler."""

from __future__ import annotations

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.metallic_roughness import METALLIC_ROUGHNESS, MetallicRoughnessParams
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.directions import spherical
from jaxbrdf.data.pbr import read_folder
from jaxbrdf.surface.baselines import PREFILTERS, baseline_of
from jaxbrdf.surface.prefilter import prefiltered
from jaxbrdf.surface.textured import pack, textured
from jaxbrdf.texture.pyramid import Layout, build_pyramid
from jaxbrdf.types import Query
from tests.surface.maps import gaussian_slopes, metal, mixed, normals, pairs, whole

SIZE = 8
LAYOUT = Layout(SIZE, SIZE)
OWN_FRAME = ("leadr", "sggx")
"""Those that shade facets of the surface itself, and so are a metal's BRDF."""


def texels_of(name: str, params: MetallicRoughnessParams, slopes: np.ndarray) -> jax.Array:
    layout = Layout(*slopes.shape[:2])
    return build_pyramid(layout, PREFILTERS[name].pack(params, normals(slopes)))


def rough_slopes(scale: float = 0.5) -> np.ndarray:
    return np.random.default_rng(4).normal(scale=scale, size=(SIZE, SIZE, 2))


@pytest.mark.parametrize("name", PREFILTERS)
@pytest.mark.parametrize("roughness", [0.05, 0.6])
def test_a_flat_map_is_the_material_of_its_points(name: str, roughness: float):
    query = pairs(500)
    own = MetallicRoughnessParams(jnp.array([0.9, 0.4, 0.1]), jnp.array(0.3), jnp.array(roughness))
    maps = jax.tree.map(lambda field: jnp.broadcast_to(field, (SIZE, SIZE, *field.shape)), own)
    texels = texels_of(name, maps, np.zeros((SIZE, SIZE, 2)))
    for scale in (0.0, 0.5, jnp.inf):
        wide = query._replace(footprint=jnp.full_like(query.footprint, scale))
        found = PREFILTERS[name].brdf(LAYOUT).eval(texels, wide)
        np.testing.assert_allclose(found, METALLIC_ROUGHNESS.eval(own, query), rtol=2e-3, atol=1e-6)


def hard_queries() -> Query:
    """Pairs from the normal to the horizon and below it, with footprints from none to infinite ones."""
    cos = jnp.array([1.0, 0.3, 1e-3, 1e-7, 0.0, -0.1])
    wi, wo = (spherical(jnp.arccos(cos), jnp.full(6, phi)) for phi in (0.3, 2.9))
    i, o, scale = (x.ravel() for x in jnp.meshgrid(jnp.arange(6), jnp.arange(6), jnp.array([0.0, 1e-3, 0.3, 1e6])))
    footprint = scale[:, None, None] * jnp.array([[[1.0, 0.2], [0.0, 0.1]]])
    i, o = i.astype(int), o.astype(int)
    return Query(wi[i], wo[o], jnp.broadcast_to(jnp.array([0.3, 0.6]), (len(i), 2)), footprint)


@pytest.mark.parametrize("name", PREFILTERS)
def test_values_and_gradients_are_finite(name: str):
    query = hard_queries()
    brdf = PREFILTERS[name].brdf(LAYOUT)

    @jax.jit
    def value_and_slopes(texels: jax.Array):
        def total(texels: jax.Array, wi: jax.Array, wo: jax.Array) -> tuple[jax.Array, jax.Array]:
            f = brdf.eval(texels, query._replace(wi=wi, wo=wo))
            return jnp.sum(f), f

        return jax.grad(total, argnums=(0, 1, 2), has_aux=True)(texels, query.wi, query.wo)

    # flat, even, steep up to upright normals, and mirrors
    for scale, roughness in ((0.0, 0.0), (0.0, 0.5), (1.0, 0.5), (300.0, 0.0), (300.0, 1.0)):
        slopes, f = value_and_slopes(texels_of(name, metal(roughness), rough_slopes(scale)))
        assert np.isfinite(f).all()
        assert (np.asarray(f) >= 0).all()
        assert all(np.isfinite(slope).all() for slope in slopes), (scale, roughness)


@pytest.mark.parametrize("name", OWN_FRAME)
@pytest.mark.parametrize("scale", [0.1, 1.0])
def test_a_white_metal_gains_nothing_and_is_reciprocal(name: str, scale: float):
    brdf, texels = PREFILTERS[name].brdf(LAYOUT), texels_of(name, metal(0.4), rough_slopes(scale))
    query = pairs(2000)._replace(footprint=jnp.broadcast_to(0.4 * jnp.eye(2), (2000, 2, 2)))
    f = brdf.eval(texels, query)
    np.testing.assert_allclose(f, brdf.eval(texels, query._replace(wi=query.wo, wo=query.wi)), rtol=1e-4)
    # each draw of a visible normal carries no more than one, and so no viewer gets more than that back
    drawn = sampler_of(brdf).sample(texels, query, jax.random.uniform(jax.random.key(5), (2000, 3)))
    assert float(drawn.weight.max()) < 1.0 + 1e-4
    assert float(drawn.weight.mean()) > 0.1


@pytest.mark.parametrize("name", PREFILTERS)
def test_draws_carry_the_light_that_cosines_find(name: str):
    brdf, texels = PREFILTERS[name].brdf(LAYOUT), texels_of(name, mixed(SIZE), rough_slopes(0.3))
    count = 20_000
    query = whole(spherical(jnp.full(count, 0.0), jnp.zeros(count)), spherical(jnp.float32(0.7), jnp.float32(0.4)))
    drawn = sampler_of(brdf).sample(texels, query, jax.random.uniform(jax.random.key(6), (count, 3))).weight
    cosines = pairs(count, 7).wi
    plain = jnp.pi * brdf.eval(texels, query._replace(wi=cosines))
    error = np.hypot(*(np.std(x, axis=0) / np.sqrt(count) for x in (drawn, plain)))
    assert np.all(np.abs(np.mean(drawn, axis=0) - np.mean(plain, axis=0)) < 5 * error)


def test_a_gaussian_field_from_afar():
    """Against the mean of points; what is left is GGX facets' long tail, which Gaussian slopes have not."""
    layout, own, slopes = Layout(128, 128), metal(0.2), gaussian_slopes(128, (0.2, 0.12))
    theta, phi = jnp.meshgrid(jnp.linspace(0.0, 0.9, 5), jnp.linspace(0.0, 3.1, 5))
    query = whole(spherical(theta.ravel(), phi.ravel()), spherical(jnp.float32(0.4), jnp.float32(0.5)))
    maps = build_pyramid(layout, pack(own, normals(slopes)))
    truth = jax.jit(prefiltered(textured(layout).eval, samples=32_768))(jax.random.key(0), maps, query)
    off = {
        name: float(jnp.sum(jnp.abs(one.brdf(layout).eval(texels_of(name, own, slopes), query) - truth)) / truth.sum())
        for name, one in PREFILTERS.items()
    }
    assert off["mip"] > 0.5
    assert max(off[name] for name in PREFILTERS if name != "mip") < off["mip"] / 2.0


def test_a_real_set(data_dir: Path):
    textures = read_folder(data_dir / "textures" / "Bricks102")
    small = textures._replace(**{name: getattr(textures, name)[:64, :64] for name in textures._fields[:4]})
    for name in PREFILTERS:
        _, material = baseline_of(name, "bricks", small)
        f = np.asarray(material.brdf.eval(material.params, pairs(100)))
        assert np.isfinite(f).all()
        assert 0.02 < f.mean() < 0.5


def test_a_name_that_is_none_is_refused(data_dir: Path):
    with pytest.raises(ValueError, match="mip, lean, leadr, sggx, not 'toksvig'"):
        baseline_of("toksvig", "bricks", read_folder(data_dir / "textures" / "Bricks102"))
