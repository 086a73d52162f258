"""What a bundle says of itself: model, sizes, conventions, where it comes from, how good it is and what it cost."""

from __future__ import annotations

import dataclasses
import json
from typing import Any, NamedTuple

from jaxbrdf.export.json_record import from_plain, to_plain
from jaxbrdf.models.spatial import LatentTexture
from jaxbrdf.models.table import BUNDLED, SPATIAL_MODELS, brdf_of, config_of
from jaxbrdf.types import Brdf

SCHEMA = 3
"""Version of the file's layout; a reader refuses newer ones. The first had no parts beside the model, the second no
models over a surface. A file has the lowest that knows what it holds."""

HOMOGENEOUS_SCHEMA = 2

LARGEST_SIZE = 2**20
"""No texture or layer is wider."""

LARGEST_LATENTS = 2**31
"""Numbers of all levels of a pyramid: 8 GB in float32, and what kernels count in 32 bits."""

MAY_BE_ZERO = {"config.warp_terms"}

CONVENTIONS = {
    "directions": "unit vectors, z normal, x tangent, wi to the light, wo to the viewer",
    "value": "f in 1/sr without cosine, linear Rec.709, zero below the horizon",
    "half-difference": "Rusinkiewicz 1998, polar on the disk, phi_d modulo pi",
    "texture": "channels, radius (both ends), azimuth (wraps); first row one value",
    "weights": "input, output",
}
SPATIAL_CONVENTIONS = CONVENTIONS | {
    "matrices": "channels of a texture are rows times latent channels, row by row",
    "spatial texture": "texels by channels, u right, v down the rows, levels one after the other from the finest to "
    "one texel, each half the size rounded down, texel j of n centred at (j + 1/2) / n",
}
"""Of models over a surface."""


class Provenance(NamedTuple):
    """Where the parameters come from.

    Attributes:
        input: name of the file, or of the built-in material.
        sha256: of the file's bytes, hexadecimal; empty for a built-in material.
        version: of jaxbrdf.
        seed: of the fit.
        preset: of the fit.
        steps: of the fit, as taken.
    """

    input: str
    sha256: str
    version: str
    seed: int
    preset: str
    steps: int


class Manifest(NamedTuple):
    """A bundle without its arrays.

    Attributes:
        name: of the material.
        model: one of `models.table.BUNDLED`.
        config: the model's frozen dataclass of sizes.
        provenance: where the parameters come from.
        errors: measured errors by name, as `docs/conventions.md` defines them.
        cost: what the fit took by name, such as `seconds`.
    """

    name: str
    model: str
    config: Any
    provenance: Provenance
    errors: dict[str, float]
    cost: dict[str, float]

    @property
    def isotropic(self) -> bool:
        """Whether the model leaves f unchanged when both directions turn about the normal; none over a surface does."""
        if self.is_spatial:
            return False
        return getattr(self.config, "textures", self.config).isotropic

    @property
    def is_spatial(self) -> bool:
        """Whether the model varies over a surface, so that queries need texture coordinates."""
        return self.model in SPATIAL_MODELS


def build_brdf(manifest: Manifest) -> Brdf:
    """The reflectance that the parameters belong to."""
    return brdf_of(manifest.model, manifest.config)


def to_json(manifest: Manifest) -> str:
    """The manifest as a bundle holds it.

    Raises:
        ValueError: if an error or a cost is not finite.
    """
    fields = {name: to_plain(getattr(manifest, name)) for name in Manifest._fields}
    schema = SCHEMA if manifest.is_spatial else HOMOGENEOUS_SCHEMA
    header = {"schema": schema, "conventions": _conventions(manifest), "isotropic": manifest.isotropic}
    return json.dumps({**header, **fields}, allow_nan=False)


def from_json(text: str) -> Manifest:
    """The manifest in a bundle's text; inverse of `to_json`.

    Raises:
        ValueError: naming the first thing that is wrong.
    """
    fields = _object(text)
    schema = fields.pop("schema", None)
    _check_schema(schema)
    conventions, isotropic = fields.pop("conventions", None), fields.pop("isotropic", None)
    manifest = _manifest(fields)
    if manifest.is_spatial and schema < SCHEMA:
        raise ValueError(f"schema {schema} does not know model {manifest.model}")
    if conventions != _conventions(manifest):
        raise ValueError("its conventions are not those of this jaxbrdf")
    if isotropic is not manifest.isotropic:
        raise ValueError(f"isotropic is {isotropic!r:.40}, its config says {manifest.isotropic}")
    return manifest


def _conventions(manifest: Manifest) -> dict[str, str]:
    return SPATIAL_CONVENTIONS if manifest.is_spatial else CONVENTIONS


def _object(text: str) -> dict[str, Any]:
    try:
        fields = json.loads(text)
    except (ValueError, RecursionError):
        raise ValueError("its manifest is not JSON") from None
    if not isinstance(fields, dict):
        raise ValueError("its manifest is not a JSON object")
    return fields


def _check_schema(schema: Any) -> None:
    if type(schema) is not int or schema < 1:
        raise ValueError(f"schema is {schema!r:.40}, not a version")
    if schema > SCHEMA:
        raise ValueError(f"schema {schema} is newer than this jaxbrdf, which reads up to {SCHEMA}")


def _manifest(fields: dict[str, Any]) -> Manifest:
    model = fields.get("model")
    if not isinstance(model, str) or model not in BUNDLED:
        raise ValueError(f"model {model!r:.40} is unknown, not one of {', '.join(BUNDLED)}")
    config = from_plain(config_of(model), fields.pop("config", None), "config")
    _check_sizes(config, "config")
    if model in SPATIAL_MODELS:
        _check_latents(config.latents)
    return from_plain(_Described, fields, "manifest").with_config(config)


class _Described(NamedTuple):
    """A manifest's fields whose types do not depend on the model."""

    name: str
    model: str
    provenance: Provenance
    errors: dict[str, float]
    cost: dict[str, float]

    def with_config(self, config: Any) -> Manifest:
        return Manifest(config=config, **self._asdict())


def _check_sizes(value: Any, at: str) -> None:
    """Every integer of a config counts texels, neurons or lookups."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            _check_sizes(getattr(value, field.name), f"{at}.{field.name}")
    elif isinstance(value, tuple):
        for i, item in enumerate(value):
            _check_sizes(item, f"{at}[{i}]")
    elif type(value) is int and not _least(at) <= value <= LARGEST_SIZE:
        raise ValueError(f"{at} is {value}, not a size from {_least(at)} to {LARGEST_SIZE}")


def _least(at: str) -> int:
    return 0 if at in MAY_BE_ZERO else 1


def _check_latents(latents: LatentTexture) -> None:
    numbers = latents.layout.texels * latents.channels
    if numbers >= LARGEST_LATENTS:
        raise ValueError(f"config.latents has {numbers} numbers, {LARGEST_LATENTS} are too many")
