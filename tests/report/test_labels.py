"""Labels that cover neither each other nor a point."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from jaxbrdf.report.labels import Label, place_labels


def labelled(points: np.ndarray, texts: list[str]) -> tuple[Axes, list[Annotation]]:
    figure = Figure(figsize=(5, 4), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xlim=(0, 1), ylim=(0, 1))
    figure.draw_without_rendering()
    labels = [Label(x, y, text, "black", 30.0) for (x, y), text in zip(points, texts, strict=True)]
    place_labels(axes, labels, [tuple(point) for point in points])
    return axes, [child for child in axes.get_children() if isinstance(child, Annotation)]


@pytest.mark.parametrize(("spread", "least"), [(0.5, 20), (0.1, 7)])
def test_they_cover_nothing_and_stay_inside(spread: float, least: int):
    points = 0.5 + spread * np.random.default_rng(0).uniform(-0.9, 0.9, (25, 2))
    axes, texts = labelled(points, [f"16-16 D{i}" for i in range(25)])
    assert len(texts) >= least
    boxes = [text.get_window_extent() for text in texts]
    assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
    for x, y in axes.transData.transform(points):
        assert not any(box.contains(x, y) for box in boxes)
    room = axes.get_window_extent()
    assert all(room.contains(*corner) for box in boxes for corner in box.corners())


def test_the_first_ones_come_first():
    """At one place there is room for some of many labels."""
    _, texts = labelled(np.full((60, 2), 0.5), [f"label {i}" for i in range(60)])
    assert 2 < len(texts) < 60
    assert [text.get_text() for text in texts] == [f"label {i}" for i in range(len(texts))]


def test_a_label_without_company_is_on_the_side_that_it_likes():
    axes, (text,) = labelled(np.array([[0.5, 0.5]]), ["alone"])
    box, (x, y) = text.get_window_extent(), axes.transData.transform((0.5, 0.5))
    assert box.x0 > x
    assert box.y0 + box.height / 2 > y
