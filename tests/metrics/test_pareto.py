"""The Pareto front by its definition, and against a sweep from the cheapest to the dearest."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaxbrdf.metrics.pareto import Point, pareto_front

# few different values, so that coordinates tie and points coincide
COORDINATES = st.one_of(st.integers(0, 6).map(float), st.floats(0.0, 1e6))
POINTS = st.lists(st.builds(Point, COORDINATES, COORDINATES), max_size=30)


def by_sweep(points: list[Point]) -> list[bool]:
    """From left to right a point is on the front if its error is a new record, or it equals the one that set it."""
    best, front = math.inf, set()
    for point in sorted(points):
        if point.error < best:
            best = point.error
            front.add(point)
    return [point in front for point in points]


def test_a_front_by_hand():
    points = [Point(10, 0.3), Point(20, 0.3), Point(20, 0.2), Point(30, 0.25), Point(40, 0.1), Point(10, 0.3)]
    assert pareto_front(points) == [True, False, True, False, True, True]


def test_nothing_has_no_front():
    assert pareto_front([]) == []


@given(POINTS)
def test_it_is_what_a_sweep_finds(points: list[Point]):
    assert pareto_front(points) == by_sweep(points)


@given(POINTS)
def test_every_point_off_the_front_has_one_on_it_that_is_as_good_in_both(points: list[Point]):
    found = pareto_front(points)
    front = [point for point, is_on_it in zip(points, found, strict=True) if is_on_it]
    for point, is_on_it in zip(points, found, strict=True):
        as_good = [p for p in front if p.price <= point.price and p.error <= point.error]
        assert as_good
        assert is_on_it == (set(as_good) == {point})


@given(POINTS, st.randoms(use_true_random=False))
def test_order_does_not_matter(points: list[Point], random):
    order = list(range(len(points)))
    random.shuffle(order)
    shuffled = pareto_front([points[i] for i in order])
    assert shuffled == [pareto_front(points)[i] for i in order]


@given(POINTS)
def test_neither_do_the_units(points: list[Point]):
    scaled = [Point(4.0 * point.price, 0.5 * point.error) for point in points]
    swapped = [Point(point.error, point.price) for point in points]
    assert pareto_front(scaled) == pareto_front(swapped) == pareto_front(points)


def test_what_is_no_number_is_refused():
    with pytest.raises(ValueError, match="not a number"):
        pareto_front([Point(1.0, 2.0), Point(math.nan, 1.0)])
