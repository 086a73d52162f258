"""Gradients of every model over a surface are the slopes of its values."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.models.table import SPATIAL
from tests.models.surfaces import queries, random_params, small


@pytest.mark.parametrize("name", SPATIAL)
def test_gradients_by_parameters_are_slopes(name: str):
    with jax.enable_x64(True):
        model = small(name)
        query = jax.tree.map(lambda part: jnp.asarray(part, jnp.float64), queries(7, 16))
        params = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), random_params(8, model))
        rng = np.random.default_rng(9)
        direction = jax.tree.map(lambda leaf: jnp.asarray(rng.normal(size=leaf.shape)), params)

        @jax.jit
        @jax.value_and_grad
        def along(t: jax.Array) -> jax.Array:
            moved = jax.tree.map(lambda p, d: p + t * d, params, direction)
            return model.decode(moved, model.encode(query)).sum()

        step = 1e-5
        above, below = (along(jnp.asarray(t))[0] for t in (step, -step))
        np.testing.assert_allclose(along(jnp.asarray(0.0))[1], (above - below) / (2 * step), rtol=1e-5)
