"""The models under test, in every variant, with random parameters and directions."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import jax
import numpy as np

from jaxbrdf.checks.parity import random_params
from jaxbrdf.models.table import MODELS
from jaxbrdf.types import Brdf, Model, Params, Query
from tests.export.bundles import VARIANTS

TEXTURED = [variant for variant, (model, _) in VARIANTS.items() if model in ("gated", "tripleplane")]
GENERAL = [variant for variant in VARIANTS if any(word in variant for word in ("general", "horizon", "odd"))]

# one of each model and each part
FEW = ["gated horizon", "tripleplane isotropic", "nbrdf isotropic", "naive-mlp isotropic"]
COUNT = 1024


class Case(NamedTuple):
    """A model and parameters for it."""

    model: Model
    brdf: Brdf
    params: Params


@cache
def case(variant: str) -> Case:
    """A row of `VARIANTS`, its evaluation jitted: compiled once for all tests that ask `COUNT` queries."""
    name, config = VARIANTS[variant]
    model = MODELS[name].build(config)
    return Case(model, Brdf(jax.jit(model.eval)), random_params(1, model))


def pairs(seed: int, *, count: int = COUNT) -> Query:
    """Pairs of directions uniform over the hemisphere, one half of the second close to the first."""
    rng = np.random.default_rng(seed)
    wi, wo = rng.normal(size=(2, count, 3))
    wo[::2] = wi[::2] + 10.0 ** rng.uniform(-6, 0, (len(wo[::2]), 1)) * wo[::2]
    return Query(*(unit(np.stack([w[:, 0], w[:, 1], np.abs(w[:, 2])], axis=-1)) for w in (wi, wo)))


def unit(w: np.ndarray) -> jax.Array:
    """Normalised in float64, rounded to float32."""
    return jax.numpy.asarray(w / np.linalg.norm(w, axis=-1, keepdims=True), jax.numpy.float32)


def angles(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Directions by polar angle and azimuth, float64, `(..., 3)`."""
    theta, phi = np.broadcast_arrays(theta, phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
