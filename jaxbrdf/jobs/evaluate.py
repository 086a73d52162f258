"""Values of a material at given directions."""

from __future__ import annotations

import io
from functools import partial
from zipfile import BadZipFile

import jax
import jax.numpy as jnp
import numpy as np

from jaxbrdf.data.output import check_writable, write_atomically
from jaxbrdf.errors import DataError, JaxbrdfError
from jaxbrdf.jobs.source import open_bundle, open_source
from jaxbrdf.opencl import material as device_material
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
    check_writable(output)
    wi, wo = read_directions(directions)
    values = _opencl(source, wi, wo) if backend == "opencl" else _jax(source, wi, wo)
    buffer = io.BytesIO()
    np.save(buffer, values, allow_pickle=False)
    write_atomically(output, buffer.getvalue())
    return len(values)


def read_directions(path: str) -> tuple[np.ndarray, np.ndarray]:
    """The arrays `wi` and `wo` of an .npz file, float32 `(N, 3)` unit vectors.

    Raises:
        DataError: naming the first thing that is wrong.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in ("wi", "wo")}
    except KeyError as error:
        raise DataError(path, f"has no array {error.args[0].split()[0]}; wi and wo are needed") from None
    except (OSError, ValueError, BadZipFile, EOFError, AttributeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "is not an .npz file"
        raise DataError(path, reason) from None
    for name, array in arrays.items():
        _check(path, name, array)
    if arrays["wi"].shape != arrays["wo"].shape:
        raise DataError(path, f"wi is {arrays['wi'].shape} and wo {arrays['wo'].shape}; they must be the same")
    return arrays["wi"].astype(np.float32), arrays["wo"].astype(np.float32)


def _check(path: str, name: str, array: np.ndarray) -> None:
    if array.ndim != 2 or array.shape[1] != 3:
        raise DataError(path, f"{name} has shape {array.shape}, not (N, 3)")
    if array.dtype.kind != "f":
        raise DataError(path, f"{name} is {array.dtype}, not a floating-point array")
    if not np.isfinite(array).all():
        raise DataError(path, f"{name} is not finite")
    worst = np.abs(np.linalg.norm(array.astype(np.float64), axis=1) - 1.0).max(initial=0.0)
    if worst > 1e-3:
        raise DataError(path, f"{name} holds a vector whose length is {worst:.3g} off one")


def _jax(source: str, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    material = open_source(source).material
    compiled = jax.jit(partial(material.brdf.eval, material.params))
    starts = range(0, len(wi), CHUNK)
    values = [compiled(Query(jnp.asarray(wi[i : i + CHUNK]), jnp.asarray(wo[i : i + CHUNK]))) for i in starts]
    return np.concatenate([np.zeros((0, 3), np.float32), *map(np.asarray, values)])


def _opencl(source: str, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    bundle = open_bundle(source)
    context, queue = context_of(choose())
    return device_material.evaluate(device_material.load(bundle, context), queue, wi, wo)


def check_backend(backend: str) -> None:
    """Refuses an unknown backend.

    Raises:
        JaxbrdfError: naming those that there are.
    """
    if backend not in BACKENDS:
        raise JaxbrdfError(f"no backend is called {backend!r}; there are {', '.join(BACKENDS)}")
