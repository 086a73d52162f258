"""A model at certain sizes, stored in a certain precision: what a fit makes, and what grids are made of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from jaxbrdf.errors import JaxbrdfError
from jaxbrdf.export.bundle import Precision
from jaxbrdf.models.gated import GatedConfig
from jaxbrdf.models.half_difference import TextureSizes
from jaxbrdf.models.table import ANALYTIC, MODELS, NAMES

D_TEXELS = 40
"""Radii and azimuths of D in our own arrangement of the gated model."""


@dataclass(frozen=True)
class Candidate:
    """Sizes that do not depend on the material yet.

    Raises:
        JaxbrdfError: if there is no such model.

    Attributes:
        model: one of `models.table.NAMES`.
        hidden: widths of the decoder; None for the model exactly as its paper has it. With widths, the gated model is
            in our own arrangement; the others keep the paper's textures.
        d_texels: radii and azimuths of the gated model's D, in our own arrangement; H grows in proportion.
        precision: of the stored bundle.
    """

    model: str
    hidden: tuple[int, ...] | None = None
    d_texels: int = D_TEXELS
    precision: Precision = "float32"

    def __post_init__(self) -> None:
        check_model(self.model)

    @property
    def name(self) -> str:
        """Unique among candidates, such as `gated 16-16 D80 float16` or `ggx`; float32 is left out."""
        if self.is_analytic:
            return self.model
        sizes = "paper" if self.hidden is None else "-".join(map(str, self.hidden))
        texels = [f"D{self.d_texels}"] if self.d_texels != D_TEXELS else []
        return " ".join([self.model, sizes, *texels, *([self.precision] if self.precision != "float32" else [])])

    @property
    def is_analytic(self) -> bool:
        """Whether it is solved for, not trained; it has no sizes and no texels then."""
        return self.model in ANALYTIC

    @property
    def slug(self) -> str:
        """The name as a file's."""
        return self.name.replace(" ", "-")

    @property
    def trained(self) -> Candidate:
        """What is trained for it: training is in float32, whatever is stored."""
        return replace(self, precision="float32")

    def sizes(self, *, isotropic: bool) -> Any:
        """The model's config for a material, without the azimuth that an isotropic one lacks."""
        if self.is_analytic:
            return ANALYTIC[self.model].config(isotropic=isotropic)
        textures = TextureSizes(isotropic=isotropic)
        if self.model == "gated":
            return GatedConfig(textures) if self.hidden is None else self._own_gated(self.hidden, isotropic)
        fixed = {"textures": textures} if self.model == "tripleplane" else {"isotropic": isotropic}
        return MODELS[self.model].config(**fixed, **({} if self.hidden is None else {"hidden": self.hidden}))

    def _own_gated(self, hidden: tuple[int, ...], isotropic: bool) -> GatedConfig:
        """The gated model as we fit it: at 40 texels about the paper's memory, otherwise spent.

        Without its azimuth, an isotropic H costs so little that its radius can be four times finer; that pays for two
        more channels and a finer D. The warps start where highlights need them: half of each begins as a near square
        root, half as a power.
        """
        d = self.d_texels
        textures = TextureSizes(isotropic, 128 * d // D_TEXELS if isotropic else d, d, d, d, channels=8)
        return GatedConfig(textures, hidden, h_exponents=(0.6, 1.5), d_exponents=(0.7, 2.0), horizon=True)


def check_model(name: str) -> None:
    """Finds out whether there is such a model.

    Raises:
        JaxbrdfError: if not.
    """
    if name not in NAMES:
        raise JaxbrdfError(f"no model is called {name!r}; there are {', '.join(NAMES)}")
