"""Bundles for tests: every model and variant, with parameters that reach far, and small ones."""

from __future__ import annotations

import dataclasses
from typing import Any

import jax

from jaxbrdf.checks.parity import demanding_params, random_params, with_isotropy
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.export.manifest import Manifest, Provenance
from jaxbrdf.models.gated import GatedConfig
from jaxbrdf.models.ggx_mip import GgxMipConfig
from jaxbrdf.models.half_difference import TextureSizes
from jaxbrdf.models.neumip import NeumipConfig
from jaxbrdf.models.spatial import LatentTexture
from jaxbrdf.models.spatial_gated import SpatialGatedConfig
from jaxbrdf.models.spatial_tripleplane import SpatialTripleplaneConfig
from jaxbrdf.models.table import LEARNED, MODELS
from jaxbrdf.models.zeltner import ZeltnerConfig
from jaxbrdf.types import Params

VARIANTS: dict[str, tuple[str, Any]] = {
    f"{model} {'isotropic' if isotropic else 'general'}": (model, with_isotropy(entry.config(), isotropic))
    for model, entry in MODELS.items()
    for isotropic in (True, False)
}
VARIANTS["gated horizon"] = ("gated", dataclasses.replace(with_isotropy(GatedConfig(), False), horizon=True))
VARIANTS["gated three warps"] = ("gated", GatedConfig(h_exponents=(0.6, 1.0, 2.0), d_exponents=(1.5,)))
VARIANTS["gated one warp"] = ("gated", GatedConfig(h_exponents=()))
VARIANTS["tripleplane odd sizes"] = (
    "tripleplane",
    MODELS["tripleplane"].config(textures=TextureSizes(False, 3, 5, 2, 7, 3), hidden=(5, 9, 4)),
)
VARIANTS["nbrdf linear"] = ("nbrdf", MODELS["nbrdf"].config(hidden=()))

SURFACE = SpatialGatedConfig(LatentTexture(32, 64), TextureSizes(False, 9, 10, 11, 12, 5))
SURFACES: dict[str, tuple[str, Any]] = {
    "surface": ("spatial-gated", SURFACE),
    "surface of odd sizes": (
        "spatial-gated",
        SpatialGatedConfig(LatentTexture(13, 6, 11, "clamp", 5), TextureSizes(True, 5, 4, 6, 7, 3), (5,), warp_terms=3),
    ),
    "surface without gating": ("spatial-gated", dataclasses.replace(SURFACE, gating=False)),
    "surface without frame": ("spatial-gated", dataclasses.replace(SURFACE, frame=False)),
    "surface without warps": ("spatial-gated", dataclasses.replace(SURFACE, warp_terms=0)),
    "surface of planes": (
        "spatial-tripleplane",
        SpatialTripleplaneConfig(LatentTexture(32, 64), TextureSizes(False, 9, 10, 11, 12, 3), (7,)),
    ),
    "surface of frames": ("zeltner", ZeltnerConfig(LatentTexture(32, 64, channels=9), frames=3, hidden=(9, 5))),
    "surface of relief": (
        "neumip",
        NeumipConfig(LatentTexture(32, 64), (9,), LatentTexture(16, 32, channels=7, levels=1), (6,)),
    ),
    "surface of lobes": ("ggx-mip", GgxMipConfig(LatentTexture(32, 64, channels=12))),
}

PROVENANCE = Provenance("chm_light_blue_rgb.bsdf", "ab" * 32, "0.1.0", 3, "quick", 1000)
SMALL = GatedConfig(textures=TextureSizes(False, 4, 5, 6, 7, 2), hidden=(3,))


def bundle_of(model: str, config: Any, params: Params) -> Bundle:
    """The parameters with a manifest."""
    return Bundle(Manifest("light blue", model, config, PROVENANCE, {"mae": 0.01}, {"seconds": 60.0}), params)


def random_bundle(variant: str) -> Bundle:
    """A row of `VARIANTS` or of `SURFACES` with random parameters."""
    model, config = (VARIANTS | SURFACES)[variant]
    return bundle_of(model, config, random_params(1, LEARNED[model].build(config)))


def demanding_bundle(variant: str) -> Bundle:
    """A row of `VARIANTS` or of `SURFACES` with random parameters whose f spans six decades."""
    model, config = (VARIANTS | SURFACES)[variant]
    return bundle_of(model, config, demanding_params(jax.random.key(0), LEARNED[model].build(config)))


def small_bundle() -> Bundle:
    """A gated bundle of a few kilobytes."""
    return bundle_of("gated", SMALL, random_params(1, MODELS["gated"].build(SMALL)))
