from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from jaxbrdf.texture.angular import Polar, close_centre, fetch
from jaxbrdf.texture.gated import fetch_gated

RADII, AZIMUTHS, ROWS, CHANNELS = 5, 7, 3, 4


def places(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Centre, rim, seam and random places."""
    edges = np.array([(r, t) for r in (0.0, 0.5, 1.0) for t in (0.0, 6.5 / 7, 0.99999994)])
    return tuple(np.concatenate([edges, np.random.default_rng(1).uniform(size=(count, 2))]).T)


def case(azimuths: int, count: int = 200):
    rng = np.random.default_rng(2)
    r, turn = (jnp.asarray(x) for x in places(count))
    texture = close_centre(jnp.asarray(rng.normal(size=(ROWS * CHANNELS, RADII, azimuths))))
    z = jnp.asarray(rng.normal(size=(CHANNELS, r.shape[0])))
    return texture, r, turn if azimuths > 1 else None, z


def plain(texture: jax.Array, r: jax.Array, turn: jax.Array | None, z: jax.Array) -> jax.Array:
    """Fetched first, multiplied afterwards."""
    matrices = fetch(texture, Polar(r, turn)).reshape(-1, *z.shape)
    return jnp.einsum("ncb,cb->nb", matrices, z)


def fused(texture: jax.Array, r: jax.Array, turn: jax.Array | None, z: jax.Array) -> jax.Array:
    return fetch_gated(texture, Polar(r, turn), z)


def test_matrices_are_interpolated_and_multiply_z():
    with jax.enable_x64(True):
        texture, r, turn, z = case(AZIMUTHS)
        assert turn is not None
        wrapped = np.concatenate([texture, texture[:, :, :1]], axis=2)
        at = np.stack([np.asarray(r) * (RADII - 1), np.asarray(turn) * AZIMUTHS])
        matrices = np.stack([map_coordinates(channel, at, order=1) for channel in wrapped])
        wanted = np.einsum("ncb,cb->nb", matrices.reshape(ROWS, CHANNELS, -1), z)
        np.testing.assert_allclose(fused(texture, r, turn, z), wanted, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("azimuths", [1, 2, AZIMUTHS])
def test_gradients_are_those_of_the_plain_composition(azimuths: int):
    with jax.enable_x64(True):
        arguments = case(azimuths)
        weights = jnp.asarray(np.random.default_rng(3).normal(size=(ROWS, arguments[1].shape[0])))
        numbers = (0, 1, 3) if arguments[2] is None else (0, 1, 2, 3)
        found, wanted = (
            jax.jit(jax.grad(lambda *a, read=read: jnp.sum(weights * jnp.sin(read(*a))), argnums=numbers))(*arguments)
            for read in (fused, plain)
        )
        for a, b in zip(found, wanted, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-11)


def test_gradients_are_slopes():
    with jax.enable_x64(True):
        texture, _, _, z = case(AZIMUTHS, count=31)
        rng = np.random.default_rng(4)
        # away from the texels' borders, where the slopes jump
        r = jnp.asarray((rng.integers(0, RADII - 1, 40) + rng.uniform(0.1, 0.9, 40)) / (RADII - 1))
        turn = jnp.asarray((rng.integers(0, AZIMUTHS, 40) + rng.uniform(0.1, 0.9, 40)) / AZIMUTHS)
        start = (texture, r, turn, z)
        way = [jnp.asarray(rng.normal(size=x.shape)) for x in start]

        def along(t: jax.Array) -> jax.Array:
            return jnp.sum(jnp.cos(fused(*(x + t * d for x, d in zip(start, way, strict=True)))))

        step = 1e-6
        slope = (along(jnp.asarray(step)) - along(jnp.asarray(-step))) / (2 * step)
        assert float(jax.jit(jax.grad(along))(jnp.asarray(0.0))) == pytest.approx(float(slope), rel=1e-6)


def test_float32_stays_within_rounding_of_float64():
    with jax.enable_x64(True):
        texture, r, turn, z = case(AZIMUTHS)
        assert turn is not None
        # the same places for both, so that none falls into another cell
        rounded = [x.astype(jnp.float32) for x in (texture, r, turn, z)]
        wanted = fused(*(x.astype(jnp.float64) for x in rounded))
        found = fused(*rounded)
    assert found.dtype == jnp.float32
    # sums of four products of numbers of up to four, interpolated at fractions of 7 texels' rounding
    np.testing.assert_allclose(found, wanted, atol=4 * 4 * 4 * 7 * 6e-8)


def test_a_texture_of_other_rows_is_refused():
    with pytest.raises(ValueError, match="texture has 12 channels"):
        fetch_gated(jnp.zeros((12, 3, 3)), Polar(jnp.zeros(2), jnp.zeros(2)), jnp.zeros((5, 2)))
