"""Maps and queries that prefilters are tested on."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.metallic_roughness import MetallicRoughnessParams
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Query


def metal(roughness: float, base: float = 1.0) -> MetallicRoughnessParams:
    """One metal everywhere."""
    return MetallicRoughnessParams(jnp.full((1, 1, 3), base), jnp.ones((1, 1)), jnp.full((1, 1), roughness))


def mixed(size: int) -> MetallicRoughnessParams:
    """Random maps."""
    rng = np.random.default_rng(0)
    return MetallicRoughnessParams(
        *(jnp.asarray(rng.uniform(0.2, 0.9, (size, size, *more)), jnp.float32) for more in ((3,), (), ()))
    )


def normals(slopes: np.ndarray) -> jax.Array:
    """Unit normals of slopes `(H, W, 2)`."""
    normal = np.append(-slopes, np.ones_like(slopes[..., :1]), axis=-1)
    return jnp.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True), jnp.float32)


def gaussian_slopes(size: int, deviations: tuple[float, float], mean: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """Slopes of a periodic random height field of independent waves, `(size, size, 2)`, of these moments exactly."""
    f = np.fft.fftfreq(size, 1.0 / size)
    x, y = np.meshgrid(f, f)
    rng = np.random.default_rng(1)
    band = (np.hypot(x, y) > 2.0) & (np.hypot(x, y) < size / 8.0)
    waves = np.where(band, rng.normal(size=(size, size)) + 1j * rng.normal(size=(size, size)), 0.0)
    slopes = np.stack([np.fft.ifft2(1j * k * waves).real for k in (x, y)], axis=-1).reshape(-1, 2)
    white = (slopes - slopes.mean(0)) @ np.linalg.inv(np.linalg.cholesky(np.cov(slopes.T, ddof=0))).T
    return (white * deviations + mean).reshape(size, size, 2)


def whole(wi: jax.Array, wo: jax.Array) -> Query:
    """The pairs with all of the texture under their footprints, several times."""
    wi, wo = jnp.broadcast_arrays(wi, wo)
    return Query(wi, wo, jnp.full((*wi.shape[:-1], 2), 0.5), jnp.broadcast_to(4.0 * jnp.eye(2), (*wi.shape[:-1], 2, 2)))


def pairs(count: int, seed: int = 1) -> Query:
    """Light and viewer over the cosine, at random places with no footprint to speak of."""
    u = jax.random.uniform(jax.random.key(seed), (3, count, 2))
    return Query(square_to_cosine(u[0]), square_to_cosine(u[1]), u[2], jnp.zeros((count, 2, 2)))
