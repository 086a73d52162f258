"""Which candidates are worth their price."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


class Point(NamedTuple):
    """A candidate in the plane of what it costs and what it misses; less of both is better."""

    price: float
    error: float


def pareto_front(points: Sequence[Point]) -> list[bool]:
    """Whether each point is on the front: no other is at least as good in both and better in one.

    Equal points are on it together, or not at all.

    Raises:
        ValueError: if a coordinate is not a number.
    """
    if any(x != x for point in points for x in point):
        raise ValueError(f"points has a coordinate that is not a number: {points}")
    return [not any(_is_better(other, point) for other in points) for point in points]


def _is_better(a: Point, b: Point) -> bool:
    """Whether a makes b needless."""
    return a.price <= b.price and a.error <= b.error and a != b
