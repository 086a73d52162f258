"""Learned shading frames: axes, what they make of directions, and where they degenerate."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.core.directions import sum_and_half_difference
from jaxbrdf.models.shading_frame import Frame, frame_of, pair_above, seen
from tests.models.surfaces import queries


def lifted(frame: Frame, w: jax.Array) -> jax.Array:
    """w as one of a pair with a direction to the side of it."""
    w, other = (w[0], w[1], w[2]), (w[1], -w[0], w[2])
    both, across = pair_above(frame, *sum_and_half_difference(w, other))
    return jnp.stack([0.5 * a + b for a, b in zip(both, across, strict=True)])


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
    np.testing.assert_allclose(lifted(frame, w), w, atol=2e-7)


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
    np.testing.assert_allclose(above[:2], inside[:2], atol=5e-7)
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


def test_opposed_directions_keep_their_digits():
    """In a tilted frame, against float64: the sum has the digits that the directions' own sum has."""
    numbers = np.random.default_rng(3).normal(size=(6, 200), scale=0.5)
    w = np.asarray(directions(200), np.float64)
    wi = w.astype(np.float32)
    wo = (-w * [[1.0], [1.0], [-1.0]] * [[1.0], [1.0], [1e-6]] + [[3e-6], [0], [0]]).astype(np.float32)
    wi[2] *= np.float32(1e-6)

    def seen_pair(kind: type) -> list[np.ndarray]:
        pair = sum_and_half_difference(*(tuple(jnp.asarray(x, kind) for x in v) for v in (wi, wo)))
        return [np.stack(part) for part in pair_above(frame_of(jnp.asarray(numbers.astype(np.float32), kind)), *pair)]

    narrow = seen_pair(np.float32)
    with jax.enable_x64(True):
        wide = seen_pair(np.float64)
    for one, other in zip(narrow, wide, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=2e-6 * np.linalg.norm(other, axis=0).max())
    sums = np.linalg.norm(narrow[0][:2] - wide[0][:2], axis=0) / np.linalg.norm(wide[0], axis=0)
    assert np.median(sums) < 1e-6
