"""The numbers that the kernels of analytic models read, prepared so that no query computes what all have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from jaxbrdf.core.roughness import Isotropic
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.models.ggx import GgxLobe, GgxLobesParams


class Constants(NamedTuple):
    """Macros, and arrays by the name of the macro that is to say their place."""

    macros: dict[str, str]
    arrays: dict[str, np.ndarray]


def constants(bundle: Bundle) -> Constants:
    """What the kernel of the bundle's analytic model reads, in float64."""
    return _PREPARE[bundle.manifest.model](bundle.params)


def _ggx(params: GgxLobesParams) -> Constants:
    lobes = np.concatenate([_lobe(lobe) for lobe in params.lobes])
    diffuse = {} if params.albedo is None else {"JB_DIFFUSE": np.asarray(params.albedo, np.float64) / np.pi}
    return Constants({"JB_LOBE_COUNT": str(len(params.lobes))}, {**diffuse, "JB_LOBES": lobes})


def _lobe(lobe: GgxLobe) -> np.ndarray:
    roughness = lobe.roughness
    isotropic = isinstance(roughness, Isotropic)
    alphas = [roughness.alpha] * 2 if isotropic else [roughness.alpha_x, roughness.alpha_y]
    alpha = np.asarray(alphas, np.float64)
    angle = [] if isotropic else [np.cos(np.float64(roughness.angle)), np.sin(np.float64(roughness.angle))]
    return np.concatenate([np.ravel(lobe.f0), alpha**2, alpha**-2, [0.5 / (np.pi * alpha.prod())], angle])


_PREPARE: dict[str, Callable[[Any], Constants]] = {"ggx": _ggx, "ggx2": _ggx}
