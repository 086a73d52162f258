"""What fits of a surface are judged by: a small planar scene, and plain mip maps beside them."""

from __future__ import annotations

import jax

from jaxbrdf.export import bundle as bundles
from jaxbrdf.export.bundle import Bundle
from jaxbrdf.jobs.judge import JUDGING_SEED
from jaxbrdf.jobs.planar_judge import PlanarReference, planar_reference
from jaxbrdf.jobs.surface import Surface
from jaxbrdf.render.planar_scene import PlanarScene
from jaxbrdf.surface.textured import reciprocal_mip_mapped, reciprocal_textured
from jaxbrdf.types import Material

SIZE, SCALES, SAMPLES, DRAWS = 48, 7, 64, 2**13
"""Pixels a side of a picture, scales, points of a footprint, and random configurations."""


def reference_of(surface: Surface) -> PlanarReference:
    """What fits of a surface are judged by: its reciprocal part under footprints."""
    material = Material(surface.name, reciprocal_textured(surface.layout), surface.maps.texels, False)
    scene = PlanarScene(max(surface.layout.height, surface.layout.width), size=SIZE, scales=SCALES)
    return planar_reference(jax.random.key(JUDGING_SEED), material, scene, samples=SAMPLES, draws=DRAWS)


def materials_of(bundle: Bundle, surface: Surface) -> dict[str, Material]:
    """The fit, and the maps' own means shaded once, which it is meant to be better than."""
    mip = Material("mip maps", reciprocal_mip_mapped(surface.layout), surface.maps.texels, False)
    return {"fit": bundles.material(bundle), "mip maps": mip}
