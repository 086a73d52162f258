"""Writes docs/images/fit.png, the README's picture: a fit beside the measurement that it was made from.

jaxbrdf fit $JAXBRDF_DATA/rgl/chm_light_blue_rgb.bsdf -o out/chm_light_blue
python experiments/make_picture.py out/chm_light_blue $JAXBRDF_DATA/rgl/chm_light_blue_rgb.bsdf
"""

from __future__ import annotations

import argparse
from pathlib import Path

from jaxbrdf.brdf.measured import symmetrised
from jaxbrdf.export import bundle as bundles
from jaxbrdf.jobs.judge import picture_errors, render_pair
from jaxbrdf.jobs.source import open_bundle, open_source
from jaxbrdf.report.pictures import side_by_side

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "fit.png"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bundle")
    parser.add_argument("input")
    arguments = parser.parse_args()
    bundle, reference = open_bundle(arguments.bundle), symmetrised(open_source(arguments.input).material)
    pictures = render_pair(bundles.material(bundle), reference, size=288, samples=256)
    errors, manifest = picture_errors(pictures), bundle.manifest
    seconds = f"{manifest.cost['fit_seconds']:.0f} s of fitting"
    note = f"FLIP {errors['image_flip']:.4f}   SSIM {errors['image_ssim']:.4f}   {seconds}"
    title = f"{manifest.name}, {manifest.model}, {manifest.provenance.preset}"
    PICTURE.write_bytes(side_by_side(*pictures, title=title, note=note))
    print(f"{PICTURE}: {note}")


if __name__ == "__main__":
    main()
