"""The numbers that the kernels of analytic models read, prepared so that no query computes what all have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxbrdf.brdf.principled import LUMINANCE, PrincipledParams
from jaxbrdf.core.ranges import clamp
from jaxbrdf.core.roughness import ROUGHNESS, Isotropic
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.models.abc import LogAbcParams
from jaxbrdf.models.ggx import GgxLobe, GgxLobesParams


class Constants(NamedTuple):
    """Macros, and arrays by the name of the macro that is to say their place."""

    macros: dict[str, str]
    arrays: dict[str, np.ndarray]


def constants(bundle: Bundle) -> Constants:
    """What the kernel of the bundle's analytic model reads, in float64; of the nearest valid parameters, as in JAX."""
    params = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), clamp(bundle.params))
    return _PREPARE[bundle.manifest.model](params)


def _ggx(params: GgxLobesParams) -> Constants:
    lobes = np.concatenate([_lobe(lobe) for lobe in params.lobes])
    diffuse: dict[str, Any] = {} if params.albedo is None else {"JB_DIFFUSE": params.albedo / np.pi}
    return Constants({"JB_LOBE_COUNT": str(len(params.lobes))}, {**diffuse, "JB_LOBES": lobes})


def _lobe(lobe: GgxLobe) -> np.ndarray:
    roughness = lobe.roughness
    isotropic = isinstance(roughness, Isotropic)
    alpha = np.array([roughness.alpha] * 2 if isotropic else [roughness.alpha_x, roughness.alpha_y])
    angle = [] if isotropic else [np.cos(roughness.angle), np.sin(roughness.angle)]
    return np.concatenate([lobe.f0, alpha**2, alpha**-2, [0.5 / (np.pi * alpha.prod())], angle])


def _abc(params: LogAbcParams) -> Constants:
    diffuse, heights, log_b, c, eta = params
    places = {"JB_DIFFUSE": diffuse / np.pi, "JB_HEIGHTS": np.exp(heights) / np.pi}
    return Constants({}, {**places, "JB_FALL": np.stack([np.exp(log_b), c, _excess(eta)])})


def _principled(p: PrincipledParams) -> Constants:
    metal = 0.0 if p.metallic is None else p.metallic
    alpha, aspect = p.roughness**2, 1.0 if p.anisotropic is None else np.sqrt(1.0 - 0.9 * p.anisotropic)
    alphas = np.array([alpha / aspect, max(alpha * aspect, ROUGHNESS.low)])
    arrays = {
        "JB_BODY": (1.0 - metal) * p.base_color / np.pi,
        "JB_SURFACE": np.array([*alphas**2, *alphas**-2.0, 1.0 / (np.pi * alphas.prod()), p.roughness, _excess(p.eta)]),
    }
    if p.metallic is not None or p.spec_tint is not None:
        arrays["JB_TINTED"] = _tinted(p, metal)
    if p.sheen is not None:
        tint = 0.0 if p.sheen_tint is None else p.sheen_tint
        arrays["JB_SHEEN"] = (1.0 - metal) * p.sheen * (1.0 - tint + tint * _hue(p.base_color))
    if p.flatness is not None:
        arrays["JB_FLATNESS"] = np.reshape(p.flatness, 1)
    if p.clearcoat is not None:
        gloss = 0.0 if p.clearcoat_gloss is None else p.clearcoat_gloss
        squared = (0.1 - (0.1 - 0.001) * gloss) ** 2
        arrays["JB_COAT"] = np.stack([0.25 * p.clearcoat * (1.0 - squared) / (-np.pi * np.log(squared)), squared])
    return Constants({}, arrays)


def _tinted(p: PrincipledParams, metal: Any) -> np.ndarray:
    """F = grey F_exact + f0 (1 - S) + edge S of the three parts' shares: grey, edge, and f0 for R, G and B."""
    tint = (1.0 - metal) * (0.0 if p.spec_tint is None else p.spec_tint)
    f0 = tint * _hue(p.base_color) * ((p.eta - 1.0) / (p.eta + 1.0)) ** 2 + metal * p.base_color
    return np.array([1.0 - metal - tint, tint + metal, *f0])


def _hue(base: Any) -> np.ndarray:
    """The colour over its luminance; white for black."""
    luminance = base @ np.array(LUMINANCE)
    return base / luminance if luminance > 0 else np.ones(3)


def _excess(eta: Any) -> np.ndarray:
    """eta^2 - 1."""
    return (eta - 1.0) * (eta + 1.0)


_PREPARE: dict[str, Callable[[Any], Constants]] = {
    "ggx-only": _ggx,
    "ggx": _ggx,
    "ggx2": _ggx,
    "abc": _abc,
    "principled": _principled,
}
