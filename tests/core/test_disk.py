"""The concentric map: round trip, equal areas, and its singular centre and diagonals."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbrdf.core.disk import disk_to_square, square_to_disk


def test_round_trip():
    u = np.random.default_rng(0).random((10_000, 2), np.float32)
    p = square_to_disk(jnp.asarray(u))
    assert np.max(np.linalg.norm(p, axis=-1)) <= 1 + 2e-7
    np.testing.assert_allclose(disk_to_square(p), u, atol=5e-7)


def test_areas_are_kept():
    u = jnp.asarray(np.random.default_rng(1).uniform(0.02, 0.98, (1000, 2)), jnp.float32)
    jacobian = jax.jit(jax.vmap(jax.jacfwd(square_to_disk)))(u)
    determinant = jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] * jacobian[:, 1, 0]
    np.testing.assert_allclose(np.abs(determinant), np.pi, rtol=1e-4)


@pytest.mark.parametrize("u", [(0.5, 0.5), (0.0, 0.0), (1.0, 1.0), (0.0, 0.5), (0.75, 0.25), (0.5, 1.0)])
def test_corners_centre_and_diagonals(u: tuple[float, float]):
    point = square_to_disk(jnp.array(u))
    np.testing.assert_allclose(disk_to_square(point), u, atol=2e-7)
    assert np.all(np.isfinite(jax.jacfwd(square_to_disk)(jnp.array(u))))
    assert np.all(np.isfinite(jax.jacrev(disk_to_square)(point)))
