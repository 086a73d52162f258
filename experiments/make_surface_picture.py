"""Writes docs/images/plane.png: a texture set on a plane up to the horizon, with one point a pixel and filtered.

jaxbrdf fit $JAXBRDF_DATA/textures/Metal053C -o out/metal --size 256
python -m experiments.make_surface_picture out/metal $JAXBRDF_DATA/textures/Metal053C
"""

from __future__ import annotations

import argparse
from pathlib import Path

import jax
import numpy as np

from experiments.surfaces import mip_maps
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs.source import open_bundle
from jaxbrdf.jobs.surface import open_surface
from jaxbrdf.metrics.image import auto_exposure, image_errors, tonemap
from jaxbrdf.render.plane import PlaneView
from jaxbrdf.render.plane_picture import plane_directional
from jaxbrdf.report.pictures import in_a_row
from jaxbrdf.surface.textured import reciprocal_textured
from jaxbrdf.types import Brdf, Material

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "plane.png"
VIEW = PlaneView(distance=1.6, slant=74.0, field_of_view=44.0, height=288, width=288)
LIGHT = (0.05, 0.9, 0.42)
SAMPLES = 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bundle")
    parser.add_argument("folder", help="of the textures that it was fitted to")
    arguments = parser.parse_args()
    bundle = open_bundle(arguments.bundle, surfaces=True)
    latents = bundle.manifest.config.latents
    surface = open_surface(arguments.folder, size=max(latents.height, latents.width))
    exact = Material("", reciprocal_textured(surface.layout), surface.maps.texels, False)
    at_points = Brdf(lambda params, query: exact.brdf.eval(params, query._replace(footprint=None)))
    materials = {
        "one point a pixel": exact._replace(brdf=at_points),
        "mip maps": mip_maps(surface),
        f"fit, {bundle.manifest.cost['fit_seconds'] / 60.0:.0f} minutes": bundles.material(bundle),
    }
    key = jax.random.key(0)
    reference = plane_directional(key, exact, VIEW, LIGHT, samples=SAMPLES)
    pictures = {name: plane_directional(key, one, VIEW, LIGHT) for name, one in materials.items()}
    exposure = auto_exposure(reference)
    flips = {name: image_errors(picture, reference, exposure=exposure).flip for name, picture in pictures.items()}
    shown = {f"{name}: FLIP {flips[name]:.3f}": tonemap(picture, exposure) for name, picture in pictures.items()}
    shown[f"mean of {SAMPLES:,} points"] = tonemap(np.asarray(reference), exposure)
    PICTURE.write_bytes(in_a_row(shown, note=f"{surface.name}, one evaluation a pixel but on the right"))
    print(f"{PICTURE}: {', '.join(shown)}")


if __name__ == "__main__":
    main()
