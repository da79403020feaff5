"""Parts of a picture from above."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from tcs.output.draw.floor_plan import cell_widths, draw_base, draw_cells, draw_scale_bar, frame
from tcs.placement.tables.place_map import PlaceMap
from tests.output.draw.test_map import SQUARE, stand


@pytest.fixture
def axes():
    return Figure(figsize=(4, 3)).subplots()


@pytest.mark.parametrize(("width", "wording"), [(4.0, 1.0), (2.0, 0.5)])
def test_the_scale_bar_has_the_stated_length(axes, width, wording):
    frame(axes, [np.array([[0.0, 0.0], [width, 2.0]])], margin=0.0)
    draw_scale_bar(axes)
    (bar,) = axes.lines
    assert np.ptp(bar.get_xdata()) == pytest.approx(wording)
    assert [text.get_text() for text in axes.texts] == [f"{wording:g} m"]
    # A metre is as long along y.
    assert axes.get_aspect() == 1.0


@pytest.mark.parametrize("yaw", [0.0, 0.7, math.pi])
def test_the_base_is_drawn_to_scale_and_headed(axes, yaw):
    draw_base(axes, stand(x=1.0, y=2.0, yaw=yaw), label="1")
    outline = [patch for patch in axes.patches if isinstance(patch, Polygon)][-1].get_xy()[:-1]
    sides = np.linalg.norm(np.diff(outline, axis=0), axis=1)
    np.testing.assert_allclose(sides, [0.6, 0.4, 0.6], atol=1e-12)
    np.testing.assert_allclose(outline.mean(axis=0), [1.0, 2.0], atol=1e-12)
    arrow = next(text for text in axes.texts if text.get_text() == "")
    ahead = np.array(arrow.xy) - [1.0, 2.0]
    assert math.atan2(ahead[1], ahead[0]) == pytest.approx(math.atan2(math.sin(yaw), math.cos(yaw)))
    # Its tip is beyond the front of the base.
    assert np.linalg.norm(ahead) > SQUARE[:, 0].max()


def test_cells_of_base_positions_far_apart_leave_gaps():
    """Two rails half a metre apart: strips, with nothing between them."""
    x, y = np.array([0.0, 0.1, 0.2]), np.array([-0.5, 0.5])
    reached = np.array([[1.0, 0.0], [0.5, 1.0], [1.0, 1.0]])
    free = np.array([[True, False], [True, True], [True, True]])
    places = PlaceMap(x, y, reached, reached, free)
    figure = Figure()
    mesh = draw_cells(figure.subplots(), places, reached, 1.0)
    edges = mesh.get_coordinates()
    np.testing.assert_allclose(edges[0, :, 0], [-0.05, 0.05, 0.15, 0.25])
    np.testing.assert_allclose(edges[:, 0, 1], [-0.7, -0.3, 0.3, 0.7])
    shown = mesh.get_array()
    assert shown.mask.tolist() == [[False] * 3, [True] * 3, [True, False, False]]
    np.testing.assert_allclose(shown[0], [1.0, 0.5, 1.0])
    assert cell_widths(x, np.array([0.3])) == pytest.approx((0.1, 0.05))
