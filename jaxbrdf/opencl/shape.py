"""How a kernel is cut for a device: queries a work item, and outputs of a layer that are summed at once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

WIDTHS = (1, 4, 8, 16)


class Tiles(NamedTuple):
    """A layer's outputs as `count` tiles of `rows` and `more` of one row less."""

    count: int
    rows: int
    more: int

    def slices(self) -> Iterator[slice]:
        """The outputs of one tile after the other."""
        start = 0
        for size in [self.rows] * self.count + [self.rows - 1] * self.more:
            yield slice(start, start + size)
            start += size

    def layer(self, n_in: int, activation: str) -> str:
        """The layer as network.cl's JB_LAYER takes it; SiLU is too long for a tile's registers and comes after."""
        in_tile, after = ("linear", activation) if activation.endswith("silu") else (activation, "nothing")
        sizes = f"{n_in}, {self.count}, {self.rows}, {self.more}, {max(self.rows - 1, 1)}"
        return f"LAYER({sizes}, {in_tile}, {after})"


class Shape(NamedTuple):
    """A kernel's cut.

    Attributes:
        width: queries that a work item evaluates as vectors, one of `WIDTHS`.
        rows: the most outputs of a layer whose sums are held in registers, up to 12, the largest tile of network.cl.
    """

    width: int
    rows: int

    @property
    def group(self) -> int:
        """Work items of a work group: a processor takes 256 queries at a time, a GPU a few of its wavefronts."""
        return 16 if self.width > 1 else 128

    def grid(self, count: int) -> tuple[int]:
        """Work items in all for `count` queries, a whole number of groups."""
        queries = self.width * self.group
        return (-(-count // queries) * self.group,)

    def tiles(self, outputs: int) -> Tiles:
        """The outputs of a layer in as few tiles as possible, as even as possible."""
        count = -(-outputs // self.rows)
        rows = -(-outputs // count)
        more = count * rows - outputs
        return Tiles(count - more, rows, more)


INLINE = Shape(1, 8)
"""Of a function that another kernel calls for one hit point."""
