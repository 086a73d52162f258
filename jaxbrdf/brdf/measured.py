"""A measured material from a file of any known kind, and what its noise says about it."""

from __future__ import annotations

import struct
from collections.abc import Callable
from os import PathLike
from pathlib import Path

import jax
import jax.numpy as jnp

from jaxbrdf.brdf import merl, published_nbrdf, rgl, utia
from jaxbrdf.core.directions import cos_theta
from jaxbrdf.core.numerics import safe_divide
from jaxbrdf.data import input as data_input
from jaxbrdf.data import merl as merl_data
from jaxbrdf.data import published_nbrdf as published_nbrdf_data
from jaxbrdf.data import rgl as rgl_data
from jaxbrdf.data import tensor_file
from jaxbrdf.data import utia as utia_data
from jaxbrdf.errors import DataError
from jaxbrdf.sampling.hemisphere import square_to_cosine
from jaxbrdf.types import Brdf, Material, Query, Sample

Reader = Callable[[bytes, str | PathLike[str], str], Material]

PAIRS = 2**16
"""Pairs for the shares below: their standard error is then at most 0.2 percentage points."""


def _rgl(content: bytes, path: str | PathLike[str], name: str) -> Material:
    return rgl.material(rgl_data.read(content, path), name)


def _merl(content: bytes, path: str | PathLike[str], name: str) -> Material:
    return merl.material(merl_data.read(content, path), name)


def _utia(content: bytes, path: str | PathLike[str], name: str) -> Material:
    return utia.material(utia_data.read(content, path), name)


def _published_nbrdf(content: bytes, path: str | PathLike[str], name: str) -> Material:
    return published_nbrdf.material(published_nbrdf_data.read(content, path), name)


BY_SIGNATURE: dict[bytes, Reader] = {
    tensor_file.MAGIC: _rgl,
    published_nbrdf_data.MAGIC: _published_nbrdf,
    struct.pack("<3i", *merl_data.SHAPE): _merl,
}
BY_SUFFIX: dict[str, Reader] = {".bsdf": _rgl, ".binary": _merl, ".bin": _utia, ".h5": _published_nbrdf}


def load(path: str | PathLike[str]) -> Material:
    """The material in a file, named after it: RGL `.bsdf`, MERL `.binary`, UTIA `.bin` or a published NBRDF `.h5`.

    What the file begins with decides, then its suffix. `archive.zip/name` reads a member.

    Raises:
        DataError: the file cannot be read, or is of no known kind, or is not what it claims to be.
    """
    return decode(data_input.read(path), path)


def decode(content: bytes, path: str | PathLike[str]) -> Material:
    """The material in a file's bytes, as `load` tells them apart.

    Raises:
        DataError: the bytes are of no known kind, or not what they claim to be.
    """
    path = Path(path)
    return _reader_of(content, path)(content, path, path.stem)


def _reader_of(content: bytes, path: Path) -> Reader:
    for signature, reader in BY_SIGNATURE.items():
        if content.startswith(signature):
            return reader
    if path.suffix.lower() not in BY_SUFFIX:
        raise DataError(path, "not a known measurement (RGL .bsdf, MERL .binary, UTIA .bin or NBRDF .h5)")
    return BY_SUFFIX[path.suffix.lower()]


def symmetrised(material: Material) -> Material:
    """The reciprocal part of a material, (f(wi, wo) + f(wo, wi)) / 2; light is drawn as before, if at all."""
    base = material.brdf

    def evaluate(params, query: Query) -> jax.Array:
        return 0.5 * (base.eval(params, query) + base.eval(params, _swapped(query)))

    if base.sample is None or base.pdf is None:
        return material._replace(brdf=Brdf(evaluate))
    draw, density = base.sample, base.pdf

    def sample(params, query: Query, u: jax.Array) -> Sample:
        wi, pdf, _ = draw(params, query, u)
        value = evaluate(params, query._replace(wi=wi))
        return Sample(wi, pdf, value * safe_divide(jnp.maximum(cos_theta(wi), 0.0), pdf)[..., None])

    return material._replace(brdf=Brdf(evaluate, sample, density))


def clamped_share(material: Material, *, pairs: int = PAIRS, seed: int = 0) -> float:
    """Share of the values over cosine-distributed pairs that are exactly zero: clamped, or never measured above it."""
    f = _values(material, _cosine_pairs(seed, pairs))
    return float(jnp.mean(f == 0))


def asymmetry(material: Material, *, pairs: int = PAIRS, seed: int = 0) -> float:
    """Mean of 2 |a - b| / (a + b), a = f(wi, wo) and b = f(wo, wi), over cosine-distributed pairs: from 0 to 2."""
    query = _cosine_pairs(seed, pairs)
    a, b = _values(material, query), _values(material, _swapped(query))
    return float(jnp.mean(2.0 * safe_divide(jnp.abs(a - b), a + b)))


def _values(material: Material, query: Query) -> jax.Array:
    return jax.jit(material.brdf.eval)(material.params, query)


def _swapped(query: Query) -> Query:
    return query._replace(wi=query.wo, wo=query.wi)


def _cosine_pairs(seed: int, pairs: int) -> Query:
    u = jax.random.uniform(jax.random.key(seed), (2, pairs, 2))
    wi, wo = square_to_cosine(u)
    return Query(wi, wo)
