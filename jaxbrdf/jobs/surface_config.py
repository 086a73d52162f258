"""What a fit of a texture set is asked for."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

from jaxbrdf.data.texture_name import Convention
from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.export.bundle import Precision
from jaxbrdf.fit.presets import SURFACE_PRESETS, SurfacePreset
from jaxbrdf.models.spatial import LatentTexture
from jaxbrdf.models.table import SPATIAL
from jaxbrdf.texture.pyramid import Layout


@dataclass(frozen=True)
class SurfaceFitConfig:
    """A fit of a surface as the command line asks for it.

    Attributes:
        source: a folder of textures.
        output: a folder, or a bundle's file name.
        model: a key of `models.table.SPATIAL`.
        preset: a key of `fit.presets.SURFACE_PRESETS`.
        size: texels along the longer side; None for the files' own.
        normals: convention of the normal map, over what its name says.
        resample: whether maps of other sizes are taken to that of the base colour.
        seed: of every draw.
        budget_seconds: if given, the number of steps is chosen to fit it.
        resume: go on from the checkpoint beside the output.
        precision: of the stored latents and textures.
    """

    source: str
    output: str
    model: str = "gated"
    preset: str = "quick"
    size: int | None = None
    normals: Convention | None = None
    resample: bool = False
    seed: int = 0
    budget_seconds: float | None = None
    resume: bool = False
    precision: Precision = "float32"

    @property
    def recipe(self) -> SurfacePreset:
        """How it is trained.

        Raises:
            JaxbrdfError: if there is no such preset.
        """
        if self.preset not in SURFACE_PRESETS:
            raise JaxbrdfError(f"no preset is called {self.preset!r}; there are {', '.join(SURFACE_PRESETS)}")
        return SURFACE_PRESETS[self.preset]()

    def sizes(self, layout: Layout) -> Any:
        """The model's config over a surface of this layout, as its paper has it besides.

        Raises:
            JaxbrdfError: if there is no such model.
        """
        return sizes_of(self.model, layout)


def sizes_of(model: str, layout: Layout) -> Any:
    """The config of a key of `models.table.SPATIAL` over a surface of this layout, as its paper has it besides.

    Raises:
        JaxbrdfError: if there is no such model.
    """
    if model not in SPATIAL:
        raise JaxbrdfError(f"no model of texture sets is called {model!r}; there are {', '.join(SPATIAL)}")
    config = SPATIAL[model].config()
    size = {"height": layout.height, "width": layout.width, "wrap": layout.wrap}
    textures = {
        field.name: replace(value, **size)
        for field in fields(config)
        if isinstance(value := getattr(config, field.name), LatentTexture)
    }
    return replace(config, **textures)
