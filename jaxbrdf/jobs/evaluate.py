"""Values of a material at given directions."""

from __future__ import annotations

import io
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.jobs.directions import read_directions
from jaxbrdf.jobs.source import open_bundle, open_source
from jaxbrdf.opencl.material import Material
from jaxbrdf.opencl.platform import choose, context_of
from jaxbrdf.types import Query

CHUNK = 2**18
BACKENDS = ("jax", "opencl")


def evaluate(source: str, directions: str, output: str, *, backend: str = "jax") -> int:
    """Writes f, float32 `(N, 3)`, for the arrays `wi` and `wo` of an .npz file; returns N.

    A measured file gives its own f: clamped, not symmetrised.

    Raises:
        JaxbrdfError: if the source, the directions or the backend cannot be used.
    """
    if backend not in BACKENDS:
        raise JaxbrdfError(f"no backend is called {backend!r}; there are {', '.join(BACKENDS)}")
    check_writable(output)
    wi, wo = read_directions(directions)
    values = _opencl(source, wi, wo) if backend == "opencl" else _jax(source, wi, wo)
    buffer = io.BytesIO()
    np.save(buffer, values, allow_pickle=False)
    write_atomically(output, buffer.getvalue())
    return len(values)


def _jax(source: str, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    material = open_source(source).material
    compiled = jax.jit(partial(material.brdf.eval, material.params))
    starts = range(0, len(wi), CHUNK)
    values = [compiled(Query(jnp.asarray(wi[i : i + CHUNK]), jnp.asarray(wo[i : i + CHUNK]))) for i in starts]
    return np.concatenate([np.zeros((0, 3), np.float32), *map(np.asarray, values)])


def _opencl(source: str, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    bundle = open_bundle(source)
    return Material.load(bundle, context_of(choose())).evaluate(wi, wo)
