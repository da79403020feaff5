"""Marks of goals: shapes, colours, shared marks, and where a camera sees a point."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from tcs.output.draw.camera import SIZE, nearest_camera, pixels_of, rays
from tcs.output.draw.colours import REACHED, UNREACHED
from tcs.output.draw.goal_marks import GoalMark, draw_goal_marks, goal_handles

NAMES = ("chin", "left cheek", "right cheek")
POSITIONS = np.array([[0.0, 0.0, 1.0], [0.02, 0.0, 1.1], [0.5, 0.0, 1.0]])


def marks(*reached):
    return [
        GoalMark(i, NAMES[i], POSITIONS[i], is_reached=is_reached)
        for i, is_reached in enumerate(reached)
    ]


@pytest.mark.parametrize(
    ("reached", "drawn"),
    [
        ((True, True, False), {"1 2": REACHED, "3": UNREACHED}),
        ((True, False, False), {"1": REACHED, "2": UNREACHED, "3": UNREACHED}),
    ],
    ids=["alike and close", "close but not alike"],
)
def test_goals_share_a_mark_where_they_are_close_and_alike(reached, drawn):
    axes = Figure().subplots()
    draw_goal_marks(axes, marks(*reached), POSITIONS[:, :2], apart=0.1)
    found = {text.get_text(): text.get_bbox_patch().get_facecolor() for text in axes.texts}
    assert {text: to_hex(colour) for text, colour in found.items()} == drawn


def test_the_legend_names_reached_and_unreached_goals():
    assert [handle.get_label() for handle in goal_handles(marks(True, False, True))] == [
        "reached: chin (1), right cheek (3)",
        "not reached: left cheek (2)",
    ]
    assert goal_handles([]) == []


@pytest.mark.parametrize("azimuth", [0.0, 1.0, 4.0])
def test_a_point_is_seen_where_the_ray_of_its_pixel_passes(azimuth):
    camera = nearest_camera(np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]]), azimuth)
    pixels = np.array([[100, 200], [650, 750], [1200, 1400]])
    points = camera.p + 3.0 * rays(pixels) @ camera.R
    # Rows and columns of pixels; a point is given as column and row. Rounding of some 1000 px.
    np.testing.assert_allclose(pixels_of(camera, points), pixels[:, ::-1], atol=1e-8)
    assert (pixels < SIZE[::-1]).all()
