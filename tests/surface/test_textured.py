"""Materials of maps: at points, under footprints, and of real texture sets."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.brdf.metallic_roughness import MetallicRoughnessParams
from jaxbrdf.brdf.normal_mapped import NormalMappedParams
from jaxbrdf.data.pbr import read_folder
from jaxbrdf.sampling.footprints import draw_places
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.surface.prefilter import prefiltered
from jaxbrdf.surface.textured import SHADED, mip_mapped, pack, reciprocal_textured, surface_of, textured
from jaxbrdf.texture.pyramid import Layout, build_pyramid
from jaxbrdf.types import Query

SIZE, COUNT = 8, 512
LAYOUT = Layout(SIZE, SIZE)


def maps() -> tuple[MetallicRoughnessParams, jax.Array]:
    rng = np.random.default_rng(0)
    numbers = [jnp.asarray(rng.uniform(0.2, 0.9, (SIZE, SIZE, *more)), jnp.float32) for more in ((3,), (), ())]
    normal = np.append(rng.uniform(-0.3, 0.3, (SIZE, SIZE, 2)), np.ones((SIZE, SIZE, 1)), axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return MetallicRoughnessParams(*numbers), jnp.asarray(normal, jnp.float32)


def pairs(count: int = COUNT) -> Query:
    u = jax.random.uniform(jax.random.key(1), (2, count, 2))
    return Query(square_to_cosine(u[0]), square_to_cosine(u[1]))


@pytest.fixture(scope="module")
def texels() -> jax.Array:
    return build_pyramid(LAYOUT, pack(*maps()))


def test_a_texels_centre_has_its_numbers(texels: jax.Array):
    row, column = np.divmod(np.random.default_rng(1).integers(0, SIZE * SIZE, COUNT), SIZE)
    uv = jnp.asarray(np.stack([(column + 0.5) / SIZE, (row + 0.5) / SIZE], axis=-1), jnp.float32)
    params, normal = maps()
    own = NormalMappedParams(normal[row, column], MetallicRoughnessParams(*(field[row, column] for field in params)))
    want = SHADED.eval(own, pairs())
    found = jax.jit(textured(LAYOUT).eval)(texels, pairs()._replace(uv=uv))
    np.testing.assert_allclose(found, want, rtol=1e-4, atol=1e-6)


def test_maps_that_are_the_same_everywhere_need_no_filter():
    params, normal = maps()
    flat = jax.tree.map(lambda field: jnp.broadcast_to(field[:1, :1], field.shape), (params, normal))
    texels = build_pyramid(LAYOUT, pack(*flat))
    query = pairs()
    uv, footprint = draw_places(jax.random.key(2), query.wo, texels=SIZE)
    points = textured(LAYOUT).eval(texels, query._replace(uv=uv))
    wide = query._replace(uv=uv, footprint=footprint)
    averaged = prefiltered(textured(LAYOUT).eval, samples=4)(jax.random.key(3), texels, wide)
    np.testing.assert_allclose(averaged, points, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(jax.jit(mip_mapped(LAYOUT).eval)(texels, wide), points, rtol=1e-4, atol=1e-6)


def test_the_reciprocal_part_is_reciprocal(texels: jax.Array):
    query = pairs()._replace(uv=jax.random.uniform(jax.random.key(4), (COUNT, 2)))
    evaluate = jax.jit(partial(reciprocal_textured(LAYOUT).eval, texels))
    swapped = evaluate(query._replace(wi=query.wo, wo=query.wi))
    np.testing.assert_allclose(evaluate(query), swapped, rtol=1e-5)


def test_queries_without_their_place_are_refused(texels: jax.Array):
    with pytest.raises(ValueError, match="uv and no footprint"):
        textured(LAYOUT).eval(texels, pairs())
    with pytest.raises(ValueError, match="uv and a footprint"):
        mip_mapped(LAYOUT).eval(texels, pairs()._replace(uv=jnp.zeros((COUNT, 2))))


def arc(count: int = 32) -> Query:
    """Lights from the normal to 1.2 radians, a viewer at the normal, and the whole texture under the footprint."""
    theta = jnp.linspace(0.0, 1.2, count)
    wi = jnp.stack([jnp.sin(theta), jnp.zeros_like(theta), jnp.cos(theta)], axis=-1)
    up = jnp.broadcast_to(jnp.array([0.0, 0.0, 1.0]), wi.shape)
    return Query(wi, up, jnp.full((count, 2), 0.5), jnp.broadcast_to(jnp.eye(2), (count, 2, 2)))


def test_normals_that_disagree_shine_wider_than_their_mean():
    """Of facets of one roughness: the mean of their normals keeps in the highlight what they send elsewhere."""
    _, normal = maps()
    metal = MetallicRoughnessParams(jnp.full((1, 1, 3), 0.9), jnp.ones((1, 1)), jnp.full((1, 1), 0.3))
    texels, query = build_pyramid(LAYOUT, pack(metal, normal)), arc()
    truth = prefiltered(textured(LAYOUT).eval, samples=1024)(jax.random.key(0), texels, query)
    plain = mip_mapped(LAYOUT).eval(texels, query)
    assert float(plain[0].mean()) > 3.0 * float(truth[0].mean())
    assert float(plain[10:].mean()) < float(truth[10:].mean())


def test_a_real_set(data_dir: Path):
    layout, material = surface_of("Bricks102", read_folder(data_dir / "textures" / "Bricks102"))
    assert (layout.height, layout.width) == (512, 1024)
    f = np.asarray(prefiltered(material.brdf.eval, samples=64)(jax.random.key(0), material.params, arc()))
    assert np.isfinite(f).all()
    # bricks: a body about as bright as its colour, and no highlight to speak of
    assert 0.02 < f.mean() < 0.5
