"""Images with their levels, from the finest down, to one texel unless told otherwise, in one flat table.

A pyramid is an array `(texels, channels)`: all levels one after the other, each row by row from the top. A texel is one
run of memory, a lookup over several levels is one gather, and OpenCL reads the same buffer as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import jax
import jax.numpy as jnp
import numpy as np

Wrap = Literal["repeat", "clamp", "mirror"]


@jax.tree_util.register_static
@dataclass(frozen=True)
class Layout:
    """Where the texels of a pyramid stand: to JAX a tree without arrays, fixed when a lookup is compiled.

    Each level has half the rows and columns of the one before, rounded down but at least one, as in OpenGL.

    Attributes:
        height: rows of the finest level.
        width: columns of the finest level.
        wrap: what lies outside one period, along both axes: the image again, its border, or its mirror image.
        levels: how many there are; None is all, down to one texel.

    Raises:
        ValueError: if a size is not positive, `wrap` is unknown, or there are not so many levels.
    """

    height: int
    width: int
    wrap: Wrap = "repeat"
    levels: int | None = None

    def __post_init__(self) -> None:
        if min(self.height, self.width) < 1:
            raise ValueError(f"a pyramid has at least one row and one column, not {self.height} x {self.width}")
        if self.wrap not in get_args(Wrap):
            raise ValueError(f"wrap is one of {', '.join(get_args(Wrap))}, not {self.wrap!r}")
        if self.levels is not None and not 1 <= self.levels <= self._whole:
            raise ValueError(f"levels is from 1 to {self._whole}, not {self.levels}")

    @property
    def _whole(self) -> int:
        """Levels down to one texel."""
        return max(self.height, self.width).bit_length()

    @property
    def top(self) -> int:
        """The last level, of one texel where none is left out."""
        return (self.levels or self._whole) - 1

    @property
    def sizes(self) -> tuple[tuple[int, int], ...]:
        """Rows and columns of every level, the finest first."""
        return tuple((max(self.height >> n, 1), max(self.width >> n, 1)) for n in range(self.top + 1))

    @property
    def offsets(self) -> tuple[int, ...]:
        """Number of texels before each level."""
        return tuple(int(n) for n in np.cumsum([0, *(rows * columns for rows, columns in self.sizes[:-1])]))

    @property
    def texels(self) -> int:
        """Number of texels of all levels."""
        return sum(rows * columns for rows, columns in self.sizes)


class Pyramid(NamedTuple):
    """A texture that knows its layout: as a parameter of a model, of which only the texels are trained.

    Attributes:
        layout: to JAX not an array.
        texels: `(texels, channels)`.
    """

    layout: Layout
    texels: jax.Array


def is_pyramid(node: object) -> bool:
    """Whether a node of a tree of parameters is a spatial texture with its layout."""
    return isinstance(node, Pyramid)


def level(layout: Layout, texels: jax.Array, number: int) -> jax.Array:
    """One level as an image `(rows, columns, channels)`.

    Raises:
        ValueError: if there is no such level, or the texels are not of the layout.
    """
    check_level(layout, number)
    check_texels(layout, texels)
    rows, columns = layout.sizes[number]
    start = layout.offsets[number]
    return texels[start : start + rows * columns].reshape(rows, columns, texels.shape[1])


def between_levels(layout: Layout, lod: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The level below a fractional one, int32, and the share of the next; a NaN's share is NaN.

    What lies outside the pyramid is on its first or its last level, where the share is zero.
    """
    lod = jnp.clip(lod, 0.0, layout.top)
    below = jnp.floor(lod)
    return jnp.clip(below.astype(jnp.int32), 0, layout.top), lod - below


def check_level(layout: Layout, number: int) -> None:
    """Refuses a level that a pyramid does not have.

    Raises:
        ValueError: naming the level and those that there are.
    """
    if not 0 <= number <= layout.top:
        raise ValueError(f"level is one of 0 to {layout.top}, not {number}")


def check_texels(layout: Layout, texels: jax.Array) -> None:
    """Refuses an array that is not a pyramid of the layout: compiled lookups do not look whether a texel is there.

    Raises:
        ValueError: naming its shape and what would be right.
    """
    if texels.ndim != 2 or texels.shape[0] != layout.texels:
        raise ValueError(f"texels are ({layout.texels}, channels), not {texels.shape}")


def build_pyramid(layout: Layout, image: jax.Array) -> jax.Array:
    """The pyramid `(texels, channels)` of an image `(height, width, channels)`: means over the area of each texel.

    A texel of the image that is cut by a border between two of a level counts for both, by what each has of it.

    Raises:
        ValueError: if the image is not of the layout's size.
    """
    if image.ndim != 3 or image.shape[:2] != (layout.height, layout.width):
        raise ValueError(f"the image is {image.shape}, not ({layout.height}, {layout.width}, channels)")
    levels = [image]
    for size in layout.sizes[1:]:
        # exact from the level before only where no texel of it is cut
        nested = all(fine % coarse == 0 for fine, coarse in zip(levels[-1].shape[:2], size, strict=True))
        levels.append(_shrunk(levels[-1] if nested else image, size))
    return jnp.concatenate([image.reshape(-1, image.shape[2]) for image in levels])


def _shrunk(image: jax.Array, size: tuple[int, int]) -> jax.Array:
    """Means over equal areas, `(*size, channels)`: over the rows, then over the columns."""
    return _means(_means(image, size[0]).swapaxes(0, 1), size[1]).swapaxes(0, 1)


def _means(image: jax.Array, count: int) -> jax.Array:
    """Means over `count` equal parts of the first axis."""
    rows, columns, channels = image.shape
    if rows % count == 0:
        return jnp.mean(image.reshape(count, rows // count, columns, channels), axis=1)
    weights = jnp.asarray(_shares(rows, count), image.dtype)
    return jnp.tensordot(weights, image, axes=1, precision=jax.lax.Precision.HIGHEST)


def _shares(rows: int, count: int) -> np.ndarray:
    """What each of `rows` texels gives to each of `count` means, `(count, rows)`: the length that both share."""
    starts, texels = np.arange(count)[:, None] * (rows / count), np.arange(rows)[None, :]
    covered = np.minimum(starts + rows / count, texels + 1) - np.maximum(starts, texels)
    return np.maximum(covered, 0.0) * (count / rows)
