"""The two parts of parameters that are trained each in its own time: pyramids of latents, and everything else."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax

from jaxbrdf.texture.pyramid import is_pyramid
from jaxbrdf.types import Params


class Split(NamedTuple):
    """Of a tree, two trees of its structure; each has None for what is in the other.

    Attributes:
        shared: networks, angular textures and whatever else all places have in common.
        pyramids: what belongs to places.
    """

    shared: Any
    pyramids: Any


def split(params: Params) -> Split:
    """The parts of parameters, or of gradients by them."""

    def those(wanted: bool) -> Any:
        return jax.tree.map(lambda node: node if is_pyramid(node) is wanted else None, params, is_leaf=is_pyramid)

    return Split(those(False), those(True))


def joined(parts: Split) -> Params:
    """The tree that `split` has taken apart."""

    def there(one: Any, other: Any) -> Any:
        return other if one is None else one

    return jax.tree.map(there, *parts, is_leaf=lambda node: node is None or is_pyramid(node))
