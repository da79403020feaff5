"""Pictures of participants and repetitions: what they show of their values."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from tcs_studies.output.draw.boxes import COLOURS
from tcs_studies.output.draw.repetitions import (
    LearningPart,
    ParticipantPanel,
    RepetitionGroup,
    draw_distances,
    draw_learning,
    draw_participants,
    draw_paths,
)

VALUES = [
    [np.array([1.0, 3.0]), np.array([4.0])],
    [np.array([5.0, 7.0]), np.array([])],
]
"""Repetitions of two participants under two conditions; one has none under the second."""


def lines_with(axes, marker, size):
    return [
        line
        for line in axes.get_lines()
        if line.get_marker() == marker and line.get_markersize() == size
    ]


def test_means_of_participants_and_tests_are_shown():
    panel = ParticipantPanel("time [s]", VALUES, [(0, 1, 0.004)])
    (axes,) = draw_participants([panel], ["near", "far"]).axes
    coloured = [
        line
        for line in lines_with(axes, "o", 5)
        if to_rgba(line.get_color()) in map(to_rgba, COLOURS)
    ]
    np.testing.assert_array_equal(coloured[0].get_ydata(), [2.0, 4.0])
    np.testing.assert_array_equal(coloured[1].get_ydata(), [6.0, np.nan])
    # The large dot is the mean of the participants' means.
    large = [line.get_ydata()[0] for line in lines_with(axes, "o", 7)]
    assert large == [3.0, 6.0]
    assert [text.get_text() for text in axes.texts] == ["**"]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["near", "far"]


@pytest.fixture(scope="module")
def group():
    path = np.array([[0.0, 0.6, 0.2, 0.5], [1.0, 0.7, 0.1, 0.4], [2.0, 0.8, 0.0, 0.4]])
    table = np.array([[0.7, -0.3], [0.7, 0.3], [1.2, 0.3], [1.2, -0.3]])
    markers = np.array([[0.8, 0.0, 0.4], [0.8, 0.15, 0.4]])
    return RepetitionGroup("base", [[path, path], []], table, markers)


def test_paths_are_seen_from_above_with_the_robot_facing_up(group):
    (axes,) = draw_paths([group], 0.27).axes
    path = axes.get_lines()[0]
    np.testing.assert_allclose(path.get_xdata(), [-0.2, -0.1, 0.0])
    np.testing.assert_allclose(path.get_ydata(), [0.6, 0.7, 0.8])
    table = axes.patches[0].get_xy()
    assert table[:, 1].min() == 0.7


def test_the_distance_is_that_to_the_place(group):
    (axes,) = draw_distances([group]).axes
    distance = axes.get_lines()[0].get_ydata()
    np.testing.assert_allclose(distance[-1], 0.15)


def test_learning_shows_the_mean_and_the_curve():
    times = [np.array([5.0, 4.0, 3.0]), np.array([7.0, 6.0, 5.0]), np.array([9.0])]
    parts = [
        LearningPart("training", 0, times, (2.0, -1.0, 3.0)),
        LearningPart("none", 1, [np.array([])], None),
    ]
    first, second = draw_learning(parts).axes
    mean, curve = first.get_lines()[-2:]
    np.testing.assert_allclose(mean.get_ydata(), [6.0, 5.0, 4.0])
    np.testing.assert_allclose(curve.get_ydata(), [5.0, 4.0, 2.0 / 3.0 + 3.0])
    assert len(second.get_lines()) == 2
