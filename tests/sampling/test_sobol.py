"""Sobol's points: even in every axis and pair of axes, any count, and uniform after turning."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.sampling.sobol import rotate, sobol_points


def test_sixty_four_points_fill_every_axis_and_the_first_plane():
    points = sobol_points(64, 5)
    for axis in range(5):
        assert sorted((points[:, axis] * 64).astype(int)) == list(range(64))
    cells = (points[:, :2] * 8).astype(int)
    assert len(np.unique(cells, axis=0)) == 64


@pytest.mark.parametrize("count", [1, 2, 3, 64, 100])
def test_any_count_is_a_prefix(count: int):
    np.testing.assert_array_equal(sobol_points(count, 5), sobol_points(128, 5)[:count])


def test_no_points_are_refused():
    with pytest.raises(ValueError, match="count"):
        sobol_points(0, 5)


def test_turned_points_stay_inside_and_are_uniform():
    shift = jax.random.uniform(jax.random.key(0), (50_000, 1))
    for x in (0.0, 0.3, 0.99999994):
        turned = np.asarray(rotate(jnp.full((1, 1), x, jnp.float32), shift), float)
        assert 0 <= turned.min() <= turned.max() < 1
        assert abs(turned.mean() - 0.5) < 4 * turned.std() / np.sqrt(len(turned))
