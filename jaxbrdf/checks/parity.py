"""Does a device give what JAX gives? Demanding parameters and directions, and the measure of the difference."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pyopencl as cl
from scipy.ndimage import zoom

from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.checks.hard import hard_queries
from jaxbrdf.export.bundle import Bundle, material
from jaxbrdf.models.mlp import Mlp
from jaxbrdf.opencl.material import Material
from jaxbrdf.opencl.platform import context_of
from jaxbrdf.opencl.shape import Shape
from jaxbrdf.sampling.footprints import draw_places
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.texture.pyramid import Layout, is_pyramid
from jaxbrdf.types import Model, Params, Query

RELATIVE, ABSOLUTE = 1e-4, 1e-6
"""What is allowed: |difference| <= RELATIVE f + ABSOLUTE."""

LARGEST = 1e3
"""Over cosine-distributed pairs `demanding_params` give f from 1 / LARGEST to LARGEST."""

LATENT_DEVIATION = np.float32(0.3)
"""Of every texel of every level, each its own: frames then lean by some 20 degrees."""

RELIEF = 1e-2
"""Of heights in units of uv: float32 does not say where a viewer meets a relief of many textures' height."""

COARSE = (6, 8)
"""Random texels along radius and azimuth, which are interpolated to a texture's size: fitted textures are smooth."""


class Parity(NamedTuple):
    """The worst query.

    Attributes:
        violation: largest |difference| / (RELATIVE f + ABSOLUTE); at most 1 is a pass.
        wi, wo: where, `(3,)`.
    """

    violation: float
    wi: np.ndarray
    wo: np.ndarray


def with_isotropy(config: Any, isotropic: bool) -> Any:
    """A model's config in its isotropic or its general variant."""
    if hasattr(config, "textures"):
        return dataclasses.replace(config, textures=dataclasses.replace(config.textures, isotropic=isotropic))
    return dataclasses.replace(config, isotropic=isotropic)


def demanding_params(key: jax.Array, model: Model) -> Params:
    """Random parameters whose f has the range of a fitted glossy material; a relief is a few texels high, and lobes
    without a network are as they are drawn."""
    key_params, key_query = jax.random.split(key)
    params = random_params(int(jax.random.bits(key_params)), model)
    if hasattr(params, "height"):
        params = params._replace(height=_scaled_output(params.height, RELIEF))
    if not (isinstance(params, Mlp) or hasattr(params, "mlp")):
        return params
    query = _cosine_pairs(key_query, 4096)
    layout = next((node.layout for node in jax.tree.leaves(params, is_leaf=is_pyramid) if is_pyramid(node)), None)
    if layout is not None:
        query = placed(key_query, query, layout)
    log_f = np.log(jax.jit(model.eval)(params, query))
    low, high = log_f.min(axis=0), log_f.max(axis=0)
    return _with_outputs(params, 2.0 * np.log(np.float32(LARGEST)) / (high - low), 0.5 * (low + high))


def random_params(seed: int, model: Model) -> Params:
    """Parameters as numpy arrays, none at its first value: smooth textures, weights of variance 1 / n_in."""
    rng = np.random.default_rng(seed)
    shapes = jax.eval_shape(lambda: model.init(jax.random.key(0)))
    return jax.tree.map(lambda node: _random_node(rng, node), shapes, is_leaf=is_pyramid)


def _random_node(rng: np.random.Generator, node: Any) -> Any:
    if not is_pyramid(node):
        return _random(rng, node.shape)
    texels: Any = LATENT_DEVIATION * rng.standard_normal(node.texels.shape).astype(np.float32)
    return node._replace(texels=texels)


def _random(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    if len(shape) < 3:
        deviation = 1.3 / np.sqrt(shape[0]) if len(shape) == 2 else 0.3
        return np.asarray(deviation * rng.standard_normal(shape), np.float32)
    coarse = rng.standard_normal((shape[0], *np.minimum(shape[1:], COARSE)))
    return np.asarray(zoom(coarse, np.divide(shape, coarse.shape), order=3, mode="nearest"), np.float32)


def _scaled_output(mlp: Mlp, scale: float) -> Mlp:
    (*weights, weight), (*biases, bias) = mlp
    factor = np.float32(scale)
    return Mlp((*weights, factor * weight), (*biases, factor * bias))


def _with_outputs(params: Params, scale: np.ndarray, middle: np.ndarray) -> Params:
    """The parameters whose ln f is scale (ln f - middle), by channel."""
    mlp = params if isinstance(params, Mlp) else params.mlp
    weight, bias = mlp.weights[-1] * scale[None], (mlp.biases[-1] - middle) * scale
    changed = Mlp((*mlp.weights[:-1], weight), (*mlp.biases[:-1], bias))
    return changed if isinstance(params, Mlp) else params._replace(mlp=changed)


@partial(jax.jit, static_argnames="count")
def demanding_queries(key: jax.Array, *, count: int = 1 << 14) -> Query:
    """`count` pairs of each kind, cosine, almost equal, mirrored or opposed, grazing, below; and the hard queries."""
    keys = jax.random.split(key, 5)
    cosine = _cosine_pairs(keys[0], count)
    step = _small_steps(keys[1], count)
    mirrored = cosine.wo * jnp.array([[-1.0, -1.0, 1.0]])
    grazing = Query(_lower(keys[2], cosine.wi), _lower(keys[3], cosine.wo))
    opposed = grazing.wo * jnp.array([[-1.0, -1.0, 1.0]])
    kinds = [cosine, Query(_unit(cosine.wo + step), cosine.wo), Query(_unit(mirrored + step), cosine.wo), grazing]
    kinds += [Query(_unit(opposed + 0.01 * step), grazing.wo), Query(cosine.wi, -cosine.wo), hard_queries()]
    return Query(jnp.concatenate([q.wi for q in kinds]), jnp.concatenate([q.wo for q in kinds]))


def placed(key: jax.Array, query: Query, layout: Layout) -> Query:
    """The query's directions `(n, 3)` at places and under footprints of every size, hard ones among them: of size zero,
    of no width, beyond the texture, and coordinates on its border and periods away."""
    # nearer to the horizon footprints are so long that float32 does not say where they end
    upright = query.wo.at[:, 2].set(jnp.maximum(query.wo[:, 2], 0.1))
    uv, footprint = draw_places(key, upright, texels=max(layout.height, layout.width))
    count = uv.shape[0] // 16
    uv = uv.at[:count].set(8.0 * uv[:count] - 4.0).at[count].set(0.0).at[count + 1].set(1.0)
    flat = jnp.array([[0.0, 0.3], [0.0, 0.2]])
    for k, hard in enumerate((jnp.zeros((2, 2)), flat, 1e6 * jnp.eye(2))):
        footprint = footprint.at[k::64].set(hard)
    return query._replace(uv=uv, footprint=footprint)


def _cosine_pairs(key: jax.Array, count: int) -> Query:
    u = jax.random.uniform(key, (2, count, 2))
    return Query(square_to_cosine(u[0]), square_to_cosine(u[1]))


def _small_steps(key: jax.Array, count: int) -> jax.Array:
    """Vectors whose lengths spread evenly in the logarithm from 1e-8 to 1."""
    key_direction, key_length = jax.random.split(key)
    length = 10.0 ** jax.random.uniform(key_length, (count, 1), minval=-8.0, maxval=0.0)
    return length * jax.random.normal(key_direction, (count, 3))


def _lower(key: jax.Array, w: jax.Array) -> jax.Array:
    """Directions with the same azimuths and cosines from 1e-6 to 1e-1."""
    cos = 10.0 ** jax.random.uniform(key, (*w.shape[:-1], 1), minval=-6.0, maxval=-1.0)
    return _unit(jnp.concatenate([_unit(w[..., :2]), cos], axis=-1))


def _unit(w: jax.Array) -> jax.Array:
    return w / jnp.linalg.norm(w, axis=-1, keepdims=True)


def jax_values(bundle: Bundle, query: Query) -> np.ndarray:
    """What is right: f as jitted JAX gives it in float64 for directions in float32, of the query's shape."""
    return _in_float64(bundle, material(bundle).brdf.eval, query)


def jax_densities(bundle: Bundle, query: Query) -> np.ndarray:
    """The same of the density that the bundle's sampler has, `(n,)`.

    Raises:
        ValueError: the bundle has no sampler.
    """
    return _in_float64(bundle, sampler_of(material(bundle).brdf).pdf, query)


def opencl_parity(
    bundle: Bundle, device: cl.Device, query: Query, expected: np.ndarray, *, shape: Shape | None = None
) -> Parity:
    """The largest difference between OpenCL on `device` and `jax_values`, over a query of shape `(n, 3)`.

    Args:
        bundle: the material.
        device: where the kernels run.
        query: in the layout of `demanding_queries`.
        expected: f of `jax_values`.
        shape: of the kernel; None for the device's best.
    """
    found = evaluated(Material.load(bundle, context_of(device), shape=shape), query)
    violation = (np.abs(found - expected) / (RELATIVE * expected + ABSOLUTE)).max(axis=-1)
    # a NaN on either side is the worst
    worst = int(np.argmax(np.nan_to_num(violation, nan=np.inf)))
    return Parity(float(violation[worst]), np.asarray(query.wi)[worst], np.asarray(query.wo)[worst])


def evaluated(loaded: Material, query: Query) -> np.ndarray:
    """f of a query as `Material.evaluate` gives it."""
    wi, wo, uv, footprint = (None if part is None else np.asarray(part) for part in query)
    return loaded.evaluate(np.asarray(wi), np.asarray(wo), uv=uv, footprint=footprint)


def _in_float64(bundle: Bundle, function: Callable[[Params, Query], jax.Array], query: Query) -> np.ndarray:
    numbers, asked = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), (material(bundle).params, query))
    with jax.enable_x64(True):
        return np.asarray(jax.jit(function)(*jax.tree.map(jnp.asarray, (numbers, asked))))
