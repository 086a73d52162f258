"""Pools: every query is lit, and weighted means over them are means over cosine-distributed directions."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.fit.batch import Batch
from jaxbrdf.fit.pool import draw_pool
from jaxbrdf.sampling.pairs import draw_weighted
from jaxbrdf.types import Query

COUNT = 150_000


def cosines(query: Query) -> jax.Array:
    """cos_i, cos_o and cos_i^2 cos_o as if they were a colour: their means are known."""
    cos_i, cos_o = query.wi[..., 2], query.wo[..., 2]
    return jnp.stack([cos_i, cos_o, cos_i * cos_i * cos_o], axis=-1)


def drawn(seed: int) -> Batch:
    return draw_pool(jax.random.key(seed), COUNT, draw_weighted, cosines, lambda query: (query.wi[..., 2],))


@pytest.fixture(scope="module")
def pool() -> Batch:
    return drawn(0)


def test_it_has_as_many_as_asked_for_and_all_are_lit(pool: Batch):
    assert pool.importance.shape == (COUNT,)
    assert pool.target.shape == (3, COUNT)
    assert np.all(pool.importance > 0)
    assert np.all(pool.target > 0)


def test_targets_and_coordinates_belong_together(pool: Batch):
    np.testing.assert_array_equal(pool.coordinates[0], pool.target[0])


def test_weighted_means_are_those_over_cosine_distributed_directions(pool: Batch):
    """E 1 = 1, E cos = 2/3 and E cos_i^2 cos_o = 1/2 2/3 under cos / pi."""
    values = np.concatenate([np.ones((1, COUNT)), pool.target]) * pool.importance
    error = values.std(axis=1) / np.sqrt(COUNT)
    assert np.all(np.abs(values.mean(axis=1) - [1, 2 / 3, 2 / 3, 1 / 3]) < 5 * error)


def test_any_part_of_it_is_a_fair_draw(pool: Batch):
    """Batches are neighbours in the pool: none may be of one kind of draw alone."""
    parts = (pool.importance * pool.target[0])[: COUNT // 1000 * 1000].reshape(-1, 1000)
    means, spread = parts.mean(axis=1), parts.std() / np.sqrt(1000)
    assert np.abs(means - 2 / 3).max() < 5 * spread


def test_the_same_key_gives_the_same_pool_and_no_query_comes_twice(pool: Batch):
    again = drawn(0)
    np.testing.assert_array_equal(pool.importance, again.importance)
    np.testing.assert_array_equal(pool.target, again.target)
    # two chunks were drawn; single precision alone gives a few coincidences
    assert len(np.unique(pool.target[0])) > 0.95 * COUNT
