"""The ABC model (Low, Kronander, Ynnerman and Unger 2012) as it is fitted: a diffuse part and a glossy lobe of its own
fall-off. Reciprocal.

f and sampler are those of `jaxbrdf.brdf.abc`. Its heights span five decades and zero is one of them, so the model has
their logarithms, over which a solver walks evenly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Annotated, Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxbrdf.brdf.abc import ABC, AbcParams
from jaxbrdf.brdf.domain import within_ranges
from jaxbrdf.brdf.sampler import sampler_of
from jaxbrdf.core.ranges import SHARE, Range
from jaxbrdf.types import Brdf


@dataclass(frozen=True)
class AbcConfig:
    """isotropic: whether the material is that the model stands for. The model itself is, and has nothing to turn."""

    isotropic: bool = True


class LogAbcParams(NamedTuple):
    """`AbcParams` with the logarithm of `a`, `(3,)`: the authors' fits to MERL lie between -2.5 and 8.7."""

    diffuse: Annotated[jax.Array, SHARE]
    log_a: Annotated[jax.Array, Range(-8.0, 11.5)]
    log_b: Annotated[jax.Array, Range(-4.0, 17.0)]
    c: Annotated[jax.Array, Range(0.01, 10.0)]
    eta: Annotated[jax.Array, Range(1.0, 1e3)]


def abc(config: AbcConfig) -> Brdf:
    """The model as a BRDF of `LogAbcParams`."""
    del config
    sampler = sampler_of(ABC)
    return within_ranges(Brdf(*(_of_logarithms(function) for function in (ABC.eval, *sampler))))


def start_abc(key: jax.Array, config: AbcConfig) -> LogAbcParams:
    """Random parameters over what the authors' fits to MERL span, c and eta even in their logarithm."""
    del config
    u = jax.random.uniform(key, (10,))
    c, eta = 0.1 * 30.0 ** u[8], 1.1 * 20.0 ** u[9]
    return LogAbcParams(diffuse=u[:3], log_a=10.0 * u[3:6] - 2.0, log_b=2.0 + 14.0 * u[7], c=c, eta=eta)


def _plain(params: LogAbcParams) -> AbcParams:
    """The parameters as `jaxbrdf.brdf.abc` has them."""
    return AbcParams(params.diffuse, jnp.exp(params.log_a), params.log_b, params.c, params.eta)


def _of_logarithms(function: Callable) -> Callable:
    @wraps(function)
    def of_logarithms(params: LogAbcParams, *rest: Any) -> Any:
        return function(_plain(params), *rest)

    return of_logarithms
