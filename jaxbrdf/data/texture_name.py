"""What the name of a texture's file says of it, in the ways of ambientCG, Poly Haven, glTF and many others.

The end of a name counts, whatever its case and however its words are joined: `Bricks102_1K-JPG_NormalGL`,
`rusty_metal_rough_1k`, `baseColor`. Words of size and format behind the map's word are passed over.
"""

from __future__ import annotations

import re
from itertools import product
from typing import Literal, NamedTuple

Convention = Literal["opengl", "directx"]
Role = Literal["base colour", "normal", "roughness", "metallic", "packed", "other"]

WORD = re.compile(r"\d+K(?![a-z])|[A-Z]?[a-z0-9]+|[A-Z0-9]+(?![a-z])")
BESIDE_THE_MAP = re.compile(r"\d+(k|px|x\d+|bits?|b)?|jpe?g|png|exr|hdr|tiff?|map|tex|texture")
MOST_WORDS = 4
"""A map's words at most, as in `normal_map_direct_x`."""

BASE_COLOUR = ("albedo", "basecolor", "basecolour", "color", "colour", "col", "diffuse", "diff")
NORMAL = ("normal", "normals", "normalmap", "nor", "norm", "nrm")
CONVENTIONS: dict[str, Convention] = {"gl": "opengl", "ogl": "opengl", "opengl": "opengl"}
CONVENTIONS |= {"dx": "directx", "directx": "directx"}
LINEAR = ("linear", "lin", "raw")
PACKED = ("orm", "arm", "occlusionroughnessmetallic", "aoroughnessmetallic", "metallicroughness", "roughnessmetallic")
"""Roughness in green, metallic in blue. `metal_rough` is none: `rusty_metal_rough` is the roughness of rusty metal."""

OTHER = ("ao", "ambientocclusion", "occlusion", "displacement", "disp", "height", "bump", "opacity", "alpha", "mask")
OTHER += ("specular", "spec", "glossiness", "gloss", "emissive", "emission", "translucent", "preview", "thumbnail")


class TextureName(NamedTuple):
    """What a file's name says.

    Attributes:
        role: the map it is; `packed` has roughness and metallic in its green and blue channel, `other` is a map that
            a metallic-roughness material does not have.
        convention: of a normal map, where the name tells.
        linear: whether a base colour is said to be linear.
    """

    role: Role
    convention: Convention | None = None
    linear: bool = False


TABLE: dict[str, TextureName] = {
    **{word: TextureName("base colour") for word in BASE_COLOUR},
    **{word + "srgb": TextureName("base colour") for word in BASE_COLOUR},
    **{word + end: TextureName("base colour", linear=True) for word, end in product(BASE_COLOUR, LINEAR)},
    **{word: TextureName("normal") for word in NORMAL},
    **{word + end: TextureName("normal", CONVENTIONS[end]) for word, end in product(NORMAL, CONVENTIONS)},
    **{word: TextureName("roughness") for word in ("roughness", "rough")},
    **{word: TextureName("metallic") for word in ("metallic", "metalness", "metal")},
    **{word: TextureName("packed") for word in PACKED},
    **{word: TextureName("other") for word in OTHER},
}


def texture_name(stem: str) -> TextureName | None:
    """What a file name without its suffix says of the map; None if it names none."""
    words = [word.lower() for word in WORD.findall(stem)]
    while words and BESIDE_THE_MAP.fullmatch(words[-1]):
        words.pop()
    # the longest first: `metallic_roughness` is not a roughness map
    ends = ("".join(words[-count:]) for count in range(min(MOST_WORDS, len(words)), 0, -1))
    return next((TABLE[end] for end in ends if end in TABLE), None)
