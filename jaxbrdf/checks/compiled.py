"""A BRDF's functions compiled once each and asked in chunks of one size, since compiling takes longer than asking."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.types import Brdf, Params, Query, Sample

CHUNK = 2**14


@jax.jit(static_argnums=0)
def _evaluate(brdf: Brdf, params: Params, query: Query) -> jax.Array:
    return brdf.eval(params, query)


@jax.jit(static_argnums=0)
def _density(brdf: Brdf, params: Params, query: Query) -> jax.Array:
    return sampler_of(brdf).pdf(params, query)


@jax.jit(static_argnums=0)
def _draw(brdf: Brdf, params: Params, wo: jax.Array, u: jax.Array) -> Sample:
    return sampler_of(brdf).sample(params, Query(wo, wo), u)


def values(brdf: Brdf, params: Params, query: Query) -> np.ndarray:
    """f, `(..., 3)`, of a query of shape `(..., 3)`; parameters have no batch shape, here as below."""
    return _in_chunks(lambda q: _evaluate(brdf, params, q), query)


def densities(brdf: Brdf, params: Params, query: Query) -> np.ndarray:
    """The sampler's density, `(...)`.

    Raises:
        ValueError: the BRDF has no sampler.
    """
    return _in_chunks(lambda q: _density(brdf, params, q), query)


def draws(brdf: Brdf, params: Params, wo: jax.Array, u: jax.Array) -> Sample:
    """One draw for each viewer `(..., 3)` and each u `(..., 3)`, as numpy arrays.

    Raises:
        ValueError: the BRDF has no sampler.
    """
    return _in_chunks(lambda q: _draw(brdf, params, *q), (wo, u))


def _in_chunks(function: Callable[[Any], Any], vectors: Any) -> Any:
    """`function` of arrays `(..., 3)`, the last chunk filled up with the last row."""
    batch = np.broadcast_shapes(*(leaf.shape[:-1] for leaf in jax.tree.leaves(vectors)))
    flat = jax.tree.map(lambda leaf: np.broadcast_to(np.asarray(leaf), (*batch, 3)).reshape(-1, 3), vectors)
    count = math.prod(batch)
    chunks = [jax.tree.map(np.asarray, function(_rows(flat, start, count))) for start in range(0, count, CHUNK)]
    whole = jax.tree.map(lambda *parts: np.concatenate(parts)[:count], *chunks)
    return jax.tree.map(lambda leaf: leaf.reshape(*batch, *leaf.shape[1:]), whole)


def _rows(flat: Any, start: int, count: int) -> Any:
    rows = np.minimum(np.arange(start, start + CHUNK), count - 1)
    return jax.tree.map(lambda leaf: jnp.asarray(leaf[rows]), flat)
