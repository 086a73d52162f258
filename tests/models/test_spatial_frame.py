"""Learned shading frames: axes, what they make of directions, and where they degenerate."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.models.shading_frame import Frame, frame_of, seen, seen_above
from tests.models.surfaces import queries


def lifted(frame: Frame, w: jax.Array) -> jax.Array:
    return jnp.stack(seen_above(frame, (w[0], w[1], w[2])))


def matrix(frame: Frame) -> np.ndarray:
    """Axes as rows, `(3, 3, batch)`."""
    return np.asarray([list(axis) for axis in frame])


def directions(count: int) -> jax.Array:
    return queries(0, count).wi.T


def test_zeros_are_the_surfaces_own_frame():
    frame = frame_of(jnp.zeros((6, 1)))
    np.testing.assert_array_equal(matrix(frame)[..., 0], np.eye(3))
    w = directions(50)
    np.testing.assert_array_equal(seen(frame, w), w)
    np.testing.assert_array_equal(lifted(frame, w), w)


def test_axes_are_gram_and_schmidts():
    """Against QR factorisation, whose columns may have either sign: normal first, then the side's rest."""
    numbers = np.random.default_rng(1).normal(size=(6, 200))
    found = matrix(frame_of(jnp.asarray(numbers, jnp.float32)))
    for i in range(numbers.shape[1]):
        normal, side = numbers[:3, i] + [0, 0, 1], numbers[3:, i] + [1, 0, 0]
        q, r = np.linalg.qr(np.stack([normal, side], axis=1))
        n, t = (q * np.sign(np.diag(r))).T
        np.testing.assert_allclose(found[..., i], [t, np.cross(n, t), n], atol=2e-5 / min(1.0, abs(r[1, 1])))


def test_directions_keep_their_length_and_are_lifted_above_the_horizon():
    frame = frame_of(jnp.asarray(np.random.default_rng(2).normal(size=(6, 400)), jnp.float32))
    w = directions(400)
    inside, above = np.asarray(seen(frame, w)), np.asarray(lifted(frame, w))
    np.testing.assert_allclose(np.linalg.norm(inside, axis=0), 1.0, atol=1e-5)
    assert (inside[2] < 0).any()
    np.testing.assert_allclose(above[:2], inside[:2])
    np.testing.assert_allclose(above[2], np.sqrt(np.maximum(1 - inside[0] ** 2 - inside[1] ** 2, 0)), atol=2e-3)


def test_gradients_are_finite_where_axes_degenerate():
    """The normal gone, the side gone, both along each other, both gone, and next to that."""
    degenerate = np.array(
        [
            [0, 0, -1, 0, 0, 0],
            [0, 0, 0, -1, 0, 0],
            [0, 0, 0, -1, 0, 2],
            [0, 0, -1, -1, 0, 0],
            [0, 0, -1 + 1e-7, -1, 0, 0],
        ]
    )
    numbers = jnp.asarray(degenerate.T, jnp.float32)
    w = directions(numbers.shape[1])
    for project in (seen, lifted):

        def total(numbers: jax.Array, w: jax.Array, project=project) -> jax.Array:
            return jnp.sum(project(frame_of(numbers), w) * jnp.arange(1.0, 4.0)[:, None])

        slopes = jax.grad(total, argnums=(0, 1))(numbers, w)
        assert all(np.isfinite(slope).all() for slope in slopes)
        assert max(np.abs(slope).max() for slope in slopes) < 1e5
