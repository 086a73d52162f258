"""Values of a material at given directions."""

from __future__ import annotations

import io
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.errors import DataError, JaxbrdfError
from jaxbrdf.jobs.directions import Queries, read_queries
from jaxbrdf.jobs.source import open_bundle, open_source
from jaxbrdf.opencl.material import Material
from jaxbrdf.opencl.platform import choose, context_of
from jaxbrdf.types import Query

CHUNK = 2**18
BACKENDS = ("jax", "opencl")


def evaluate(source: str, directions: str, output: str, *, backend: str = "jax") -> int:
    """Writes f, float32 `(N, 3)`, for the arrays `wi`, `wo`, `uv` and `footprint` of an .npz file; returns N.

    A spatially varying bundle needs uv, and is filtered where there are footprints; others have no use for them.

    A measured file gives its own f: clamped, not symmetrised.

    Raises:
        JaxbrdfError: if the source, the directions or the backend cannot be used.
    """
    if backend not in BACKENDS:
        raise JaxbrdfError(f"no backend is called {backend!r}; there are {', '.join(BACKENDS)}")
    check_writable(output)
    queries = read_queries(directions)
    values = (_opencl if backend == "opencl" else _jax)(source, directions, queries)
    buffer = io.BytesIO()
    np.save(buffer, values, allow_pickle=False)
    write_atomically(output, buffer.getvalue())
    return len(values)


def _jax(source: str, path: str, queries: Queries) -> np.ndarray:
    opened = open_source(source, surfaces=True)
    _check_place(source, path, queries, is_spatial=opened.bundle is not None and opened.bundle.manifest.is_spatial)
    compiled = jax.jit(partial(opened.material.brdf.eval, opened.material.params))
    values = [np.zeros((0, 3), np.float32)]
    wi, wo, uv, footprint = (None if part is None else jnp.asarray(part) for part in queries)
    assert wi is not None
    assert wo is not None
    asked = Query(wi, wo, uv, footprint)
    for start in range(0, len(queries.wi), CHUNK):
        piece = jax.tree.map(lambda part, start=start: part[start : start + CHUNK], asked)
        values.append(np.asarray(compiled(piece)))
    return np.concatenate(values)


def _opencl(source: str, path: str, queries: Queries) -> np.ndarray:
    bundle = open_bundle(source, surfaces=True)
    _check_place(source, path, queries, is_spatial=bundle.manifest.is_spatial)
    material = Material.load(bundle, context_of(choose()))
    return material.evaluate(queries.wi, queries.wo, uv=queries.uv, footprint=queries.footprint)


def _check_place(source: str, path: str, queries: Queries, *, is_spatial: bool) -> None:
    if is_spatial and queries.uv is None:
        raise DataError(path, f"has no array uv, which {source} needs: it varies over a surface")
    if not is_spatial and queries.uv is not None:
        raise DataError(path, f"has an array uv, for which {source} has no use: it is the same everywhere")
