"""The models by name: what the command line, bundles and benchmarks choose from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax

from jaxbrdf.models.abc import AbcConfig, abc, start_abc
from jaxbrdf.models.gated import GatedConfig, gated
from jaxbrdf.models.ggx import BareGgxConfig, GgxConfig, TwoGgxConfig, ggx_lobes, start_ggx
from jaxbrdf.models.ggx_mip import GgxMipConfig, ggx_mip
from jaxbrdf.models.naive_mlp import NaiveMlpConfig, naive_mlp
from jaxbrdf.models.nbrdf import NbrdfConfig, nbrdf
from jaxbrdf.models.neumip import NeumipConfig, neumip
from jaxbrdf.models.principled import PrincipledConfig, principled, start_principled
from jaxbrdf.models.spatial_gated import SpatialGatedConfig, spatial_gated
from jaxbrdf.models.spatial_tripleplane import SpatialTripleplaneConfig, spatial_tripleplane
from jaxbrdf.models.tripleplane import TripleplaneConfig, tripleplane
from jaxbrdf.models.zeltner import ZeltnerConfig, zeltner
from jaxbrdf.types import Brdf, Model, Params


class ModelEntry(NamedTuple):
    """One row of the learned models.

    Attributes:
        config: the frozen dataclass of the model's sizes; called without arguments it gives the paper's.
        build: `config -> Model`.
        is_reciprocal: by construction, whatever the parameters.
    """

    config: Callable[..., Any]
    build: Callable[[Any], Model]
    is_reciprocal: bool


class SpatialEntry(NamedTuple):
    """One row of the models over a surface.

    Attributes:
        config: the frozen dataclass of the model's sizes; called without arguments it gives Timonen et al.'s.
        build: `config -> Model`, over `jaxbrdf.models.spatial.SpatialCoordinates`.
        is_reciprocal: by construction, whatever the parameters.
        bundle: its name in bundles, where homogeneous models stand beside it.
    """

    config: Callable[..., Any]
    build: Callable[[Any], Model]
    is_reciprocal: bool
    bundle: str


class AnalyticEntry(NamedTuple):
    """One row of the analytic models, which are solved for by least squares.

    Attributes:
        config: the frozen dataclass of what the model has.
        build: `config -> Brdf`.
        start: `(key, config) -> params`, random over their ranges.
        kernel: the name of its file in kernels_cl/models.
        has_axes: whether it follows an anisotropic material as that is turned; one that does not is fitted to it as
            it is.
    """

    config: Callable[..., Any]
    build: Callable[[Any], Brdf]
    start: Callable[..., Params]
    kernel: str
    has_axes: bool = True


MODELS: dict[str, ModelEntry] = {
    "gated": ModelEntry(GatedConfig, gated, is_reciprocal=True),
    "tripleplane": ModelEntry(TripleplaneConfig, tripleplane, is_reciprocal=True),
    "nbrdf": ModelEntry(NbrdfConfig, nbrdf, is_reciprocal=False),
    "naive-mlp": ModelEntry(NaiveMlpConfig, naive_mlp, is_reciprocal=False),
}

SPATIAL: dict[str, SpatialEntry] = {
    "gated": SpatialEntry(SpatialGatedConfig, spatial_gated, is_reciprocal=True, bundle="spatial-gated"),
    "tripleplane": SpatialEntry(
        SpatialTripleplaneConfig, spatial_tripleplane, is_reciprocal=True, bundle="spatial-tripleplane"
    ),
    "zeltner": SpatialEntry(ZeltnerConfig, zeltner, is_reciprocal=False, bundle="zeltner"),
    "neumip": SpatialEntry(NeumipConfig, neumip, is_reciprocal=False, bundle="neumip"),
    "ggx-mip": SpatialEntry(GgxMipConfig, ggx_mip, is_reciprocal=True, bundle="ggx-mip"),
}
"""By the names that the command line has for them over texture sets."""

ANALYTIC: dict[str, AnalyticEntry] = {
    "ggx-only": AnalyticEntry(BareGgxConfig, ggx_lobes, start_ggx, "ggx"),
    "ggx": AnalyticEntry(GgxConfig, ggx_lobes, start_ggx, "ggx"),
    "ggx2": AnalyticEntry(TwoGgxConfig, ggx_lobes, start_ggx, "ggx"),
    "abc": AnalyticEntry(AbcConfig, abc, start_abc, "abc", has_axes=False),
    "principled": AnalyticEntry(PrincipledConfig, principled, start_principled, "principled"),
}

SPATIAL_MODELS = {entry.bundle: entry for entry in SPATIAL.values()}
"""The same by their names in bundles."""

LEARNED: dict[str, ModelEntry | SpatialEntry] = {**MODELS, **SPATIAL_MODELS}

NAMES = (*MODELS, *ANALYTIC)
"""Of all that can be fitted to a homogeneous material."""

BUNDLED = (*NAMES, *SPATIAL_MODELS)
"""Of all that a bundle may hold."""


def config_of(name: str) -> Callable[..., Any]:
    """The frozen dataclass that says what the model of this name has."""
    return LEARNED[name].config if name in LEARNED else ANALYTIC[name].config


def brdf_of(name: str, config: Any) -> Brdf:
    """The model's reflectance; an analytic one can be sampled."""
    return Brdf(LEARNED[name].build(config).eval) if name in LEARNED else ANALYTIC[name].build(config)


def is_reciprocal(name: str) -> bool:
    """Whether the model of this name gives f(wi, wo) = f(wo, wi) by construction; analytic ones do."""
    return name in ANALYTIC or LEARNED[name].is_reciprocal


def kernel_of(name: str) -> str:
    """The file in kernels_cl/models that evaluates the model of this name."""
    return ANALYTIC[name].kernel if name in ANALYTIC else name.replace("-", "_")


def first_params(key: jax.Array, name: str, config: Any) -> Params:
    """Random parameters, as a fit may start from."""
    return LEARNED[name].build(config).init(key) if name in LEARNED else ANALYTIC[name].start(key, config)
