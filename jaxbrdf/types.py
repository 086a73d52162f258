"""The records every layer speaks in: a query, a sample, and the pure functions of a BRDF or a model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
from jaxtyping import Array, Float

Direction = Float[Array, "*batch 3"]
Rgb = Float[Array, "*batch 3"]
Scalar = Float[Array, "*batch"]
Params = Any


class Query(NamedTuple):
    """Where a BRDF is asked. A part that is None is an effect that is not there.

    Attributes:
        wi: unit vector to the light, `(..., 3)`, local frame (z = normal, x = tangent).
        wo: unit vector to the viewer, `(..., 3)`.
        uv: texture coordinates `(..., 2)`, or None for a homogeneous material.
        footprint: `(..., 2, 2)` matrix from the unit filter to uv, or None.
    """

    wi: jax.Array
    wo: jax.Array
    uv: jax.Array | None = None
    footprint: jax.Array | None = None


class Sample(NamedTuple):
    """A light direction drawn for a given view.

    Attributes:
        wi: `(..., 3)`; may lie below the horizon, where `weight` is zero.
        pdf: density per solid angle of wi, `(...)`.
        weight: f cos(wi) / pdf, `(..., 3)`.
    """

    wi: jax.Array
    pdf: jax.Array
    weight: jax.Array


class NoisyValue(NamedTuple):
    """An estimate of f and its standard error, both `(..., 3)`."""

    value: jax.Array
    standard_error: jax.Array


class Brdf(NamedTuple):
    """A reflectance as pure functions of its parameters.

    Attributes:
        eval: `(params, query) -> f`, `(..., 3)` in 1/sr, linear Rec.709, no cosine, zero below the horizon.
        sample: `(params, query, u) -> Sample`; reads `query.wo`, `u` is uniform in [0, 1), `(..., 3)`:
            u[0] chooses a lobe, u[1] and u[2] a direction.
        pdf: `(params, query) -> density of wi given wo`, `(...)`.
        albedo: `(params, query) -> integral of f cos(wi) over wi`, `(..., 3)`, reads `query.wo`; where a closed or
            tabulated form exists.
    """

    eval: Callable[[Params, Query], jax.Array]
    sample: Callable[[Params, Query, jax.Array], Sample] | None = None
    pdf: Callable[[Params, Query], jax.Array] | None = None
    albedo: Callable[[Params, Query], jax.Array] | None = None


class Material(NamedTuple):
    """A BRDF with its parameters: what a renderer, a fit or a comparison is handed.

    Attributes:
        name: a short name for tables and titles.
        brdf: the pure functions.
        params: the pytree that they take first.
        isotropic: whether f is unchanged when both directions turn about the normal.
    """

    name: str
    brdf: Brdf
    params: Params
    isotropic: bool


class Model(NamedTuple):
    """A learned reflectance as pure functions.

    `eval` is `decode(params, encode(query))`, exponentiated and cut at the horizon. `encode` knows no parameters, so a
    fit computes it once for each draw.

    Attributes:
        init: `key -> params`.
        encode: `query -> coordinates`, a pytree of arrays of the batch's shape.
        decode: `(params, coordinates) -> log f`, `(3, batch)` for coordinates of shape `(batch,)`.
        eval: `(params, query) -> f`, `(..., 3)`.
    """

    init: Callable[[jax.Array], Params]
    encode: Callable[[Query], Any]
    decode: Callable[[Params, Any], jax.Array]
    eval: Callable[[Params, Query], jax.Array]
