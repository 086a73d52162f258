"""The offset of NeuMIP: none at first, that of a relief's geometry, bounded, and trained."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.models.neumip import NeumipParams
from jaxbrdf.types import Query
from tests.models.surfaces import queries, random_params, small

MODEL = small("neumip")


def at_height(params: NeumipParams, height: float) -> NeumipParams:
    """The same over a relief that is flat at one height."""
    *hidden, last = params.height.weights
    *offsets, _ = params.height.biases
    flat = params.height._replace(weights=(*hidden, 0 * last), biases=(*offsets, jnp.full(1, height)))
    return params._replace(height=flat)


def test_it_starts_without_an_offset():
    params, query = MODEL.init(jax.random.key(0)), queries(0, 100)
    changed = params._replace(offset=params.offset._replace(texels=params.offset.texels + 1.0))
    evaluate = jax.jit(MODEL.eval)
    np.testing.assert_array_equal(evaluate(changed, query), evaluate(params, query))
    np.testing.assert_array_equal(evaluate(at_height(params, 0.0), query), evaluate(params, query))


def test_what_is_seen_lies_on_the_ray_to_the_viewer():
    """The ray from the place of uv meets the plane at a height where uv has moved by its slope; y is against v."""
    params, query, height = random_params(1, MODEL), queries(2, 300), 0.2
    x, y, z = np.asarray(query.wo, np.float64).T
    far = query._replace(
        uv=jnp.asarray(query.uv) + jnp.asarray(height * np.stack([x / z, -y / z], axis=-1), jnp.float32)
    )
    steep = z > 1 / 16
    found, want = (jax.jit(MODEL.eval)(at_height(params, h), q) for h, q in ((height, query), (0.0, far)))
    assert steep.sum() > 200
    np.testing.assert_allclose(found[steep], want[steep], rtol=1e-3)


def test_a_grazing_viewer_moves_it_by_sixteen_heights_at_most():
    params = at_height(random_params(3, MODEL), 1.0)
    wo = jnp.array([[np.sqrt(1 - c * c), 0.0, c] for c in (1e-30, 1e-7, 1e-3)], jnp.float32)
    query = Query(jnp.tile(jnp.array([[0.0, 0.0, 1.0]]), (3, 1)), wo, jnp.full((3, 2), 0.3))
    moved = query._replace(uv=jnp.asarray(query.uv) + jnp.array([[16.0, 0.0]]))
    evaluate = jax.jit(MODEL.eval)
    np.testing.assert_allclose(evaluate(params, query), evaluate(at_height(params, 0.0), moved), rtol=1e-3)


def test_the_offset_trains_from_the_first_step():
    params, query = MODEL.init(jax.random.key(4)), queries(5, 200)
    slopes = jax.jit(jax.grad(lambda params: jnp.sum(MODEL.decode(params, MODEL.encode(query)))))(params)
    assert np.abs(slopes.height.weights[-1]).max() > 1e-4
    # hidden layers follow once the last one has left zero
    params = params._replace(height=jax.tree.map(partial(jnp.add, 0.1), params.height))
    slopes = jax.jit(jax.grad(lambda params: jnp.sum(MODEL.decode(params, MODEL.encode(query)))))(params)
    assert np.abs(slopes.offset.texels).max() > 1e-5
