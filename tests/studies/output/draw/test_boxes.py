"""Box plots and clouds."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.output.draw import as_png, as_svg
from tcs_studies.output.draw.boxes import BoxGroup, BoxPlot, Cloud, draw_boxes, draw_clouds

SERIES = ("ours", "theirs")


@pytest.fixture
def groups(rng):
    samples = rng.uniform(20.0, 80.0, 500)
    return [
        BoxGroup("first", [BoxPlot(0, samples, (60.0, 45.0)), BoxPlot(1, samples - 10.0)]),
        BoxGroup("second", [BoxPlot(0, np.full(100, 100.0))]),
    ]


def test_each_box_spans_the_middle_half(groups):
    (axes,) = draw_boxes(groups, SERIES, label="goals [%]").axes
    assert len(axes.patches) == 3
    x = axes.patches[0].get_path().vertices[:, 0]
    samples = groups[0].boxes[0].samples
    np.testing.assert_allclose([x.min(), x.max()], np.percentile(samples, (25, 75)))
    assert [label.get_text() for label in axes.get_yticklabels()] == ["first", "second"]


def test_a_published_mean_stands_below_its_box_and_its_line_ends_at_a_hundred(groups):
    (axes,) = draw_boxes(groups, SERIES, label="goals [%]", reference="paper").axes
    diamonds = [line for line in axes.lines if line.get_marker() == "D"]
    assert [float(line.get_xdata()[0]) for line in diamonds] == [60.0]
    ends = [tuple(line.get_xdata()) for line in axes.lines if len(line.get_xdata()) == 2]
    assert (15.0, 100.0) in [tuple(map(float, pair)) for pair in ends]


def test_the_legend_names_what_is_drawn(groups):
    figure = draw_boxes(groups[1:], SERIES, label="goals [%]", reference="paper")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["ours", "mean"]


@pytest.mark.parametrize("count", [1, 4, 5])
def test_each_cloud_has_a_panel(count, rng):
    points = [(rng.random(9), rng.random(9)) for _ in range(2)]
    clouds = [Cloud(f"c{i}", points, (0.5, 50.0)) for i in range(count)]
    figure = draw_clouds(clouds, ("one", "two"), x_label="P_M", y_label="%")
    drawn = [axes for axes in figure.axes if axes.axison]
    assert [axes.get_title() for axes in drawn] == [cloud.title for cloud in clouds]
    for axes in drawn:
        for (x, y), dots in zip(points, axes.collections, strict=True):
            np.testing.assert_array_equal(dots.get_offsets(), np.column_stack([x, y]))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["one", "two", "best set"]


def test_pictures_as_bytes_are_reproducible(groups):
    def draw():
        return draw_boxes(groups, SERIES, label="goals [%]")

    assert as_svg(draw(), "a") == as_svg(draw(), "a")
    assert as_svg(draw(), "a") != as_svg(draw(), "b")
    assert b">first<" in as_svg(draw(), "a")
    assert as_png(draw())[:4] == b"\x89PNG"
