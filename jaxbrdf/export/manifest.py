"""What a bundle says of itself: model, sizes, conventions, where it comes from, how good it is and what it cost."""

from __future__ import annotations

import dataclasses
import json
from typing import Any, NamedTuple

from jaxbrdf.export.json_record import from_plain, to_plain
from jaxbrdf.models.table import NAMES, brdf_of, config_of
from jaxbrdf.types import Brdf

SCHEMA = 2
"""Version of the file's layout; a reader refuses newer ones. The first had no parts beside the model."""

LARGEST_SIZE = 2**20
"""No texture or layer is wider; it keeps the number of elements within 64 bits."""

CONVENTIONS = {
    "directions": "unit vectors, z normal, x tangent, wi to the light, wo to the viewer",
    "value": "f in 1/sr without cosine, linear Rec.709, zero below the horizon",
    "half-difference": "Rusinkiewicz 1998, polar on the disk, phi_d modulo pi",
    "texture": "channels, radius (both ends), azimuth (wraps); first row one value",
    "weights": "input, output",
}


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
        model: one of `models.table.NAMES`.
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
        """Whether the model leaves f unchanged when both directions turn about the normal."""
        return getattr(self.config, "textures", self.config).isotropic


def build_brdf(manifest: Manifest) -> Brdf:
    """The reflectance that the parameters belong to."""
    return brdf_of(manifest.model, manifest.config)


def to_json(manifest: Manifest) -> str:
    """The manifest as a bundle holds it.

    Raises:
        ValueError: if an error or a cost is not finite.
    """
    fields = {name: to_plain(getattr(manifest, name)) for name in Manifest._fields}
    header = {"schema": SCHEMA, "conventions": CONVENTIONS, "isotropic": manifest.isotropic}
    return json.dumps({**header, **fields}, allow_nan=False)


def from_json(text: str) -> Manifest:
    """The manifest in a bundle's text; inverse of `to_json`.

    Raises:
        ValueError: naming the first thing that is wrong.
    """
    fields = _object(text)
    _check_schema(fields.pop("schema", None))
    if fields.pop("conventions", None) != CONVENTIONS:
        raise ValueError("its conventions are not those of this jaxbrdf")
    isotropic = fields.pop("isotropic", None)
    manifest = _manifest(fields)
    if isotropic is not manifest.isotropic:
        raise ValueError(f"isotropic is {isotropic!r:.40}, its config says {manifest.isotropic}")
    return manifest


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
    if not isinstance(model, str) or model not in NAMES:
        raise ValueError(f"model {model!r:.40} is unknown, not one of {', '.join(NAMES)}")
    config = from_plain(config_of(model), fields.pop("config", None), "config")
    _check_sizes(config, "config")
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
    """Every integer of a config counts texels or neurons."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            _check_sizes(getattr(value, field.name), f"{at}.{field.name}")
    elif isinstance(value, tuple):
        for i, item in enumerate(value):
            _check_sizes(item, f"{at}[{i}]")
    elif type(value) is int and not 1 <= value <= LARGEST_SIZE:
        raise ValueError(f"{at} is {value}, not a size from 1 to {LARGEST_SIZE}")
