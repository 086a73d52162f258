"""A BRDF's functions compiled once each and asked in chunks of one size, since compiling takes longer than asking."""

from __future__ import annotations

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
    """f, `(n, 3)`, of a query of shape `(n, 3)`."""
    return _in_chunks(lambda q: _evaluate(brdf, params, q), query)


def densities(brdf: Brdf, params: Params, query: Query) -> np.ndarray:
    """The sampler's density, `(n,)`.

    Raises:
        ValueError: the BRDF has no sampler.
    """
    return _in_chunks(lambda q: _density(brdf, params, q), query)


def draws(brdf: Brdf, params: Params, wo: jax.Array, u: jax.Array) -> Sample:
    """One draw for each viewer `(n, 3)` and each u `(n, 3)`, as numpy arrays.

    Raises:
        ValueError: the BRDF has no sampler.
    """
    return _in_chunks(lambda q: _draw(brdf, params, *q), (wo, u))


def _in_chunks(function: Callable[[Any], Any], arguments: Any) -> Any:
    """`function` of arrays `(n, ...)`, the last chunk filled up with the last row."""
    count = len(jax.tree.leaves(arguments)[0])
    chunks = [jax.tree.map(np.asarray, function(_rows(arguments, start, count))) for start in range(0, count, CHUNK)]
    return jax.tree.map(lambda *parts: np.concatenate(parts)[:count], *chunks)


def _rows(arguments: Any, start: int, count: int) -> Any:
    rows = np.minimum(np.arange(start, start + CHUNK), count - 1)
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[rows]), arguments)
