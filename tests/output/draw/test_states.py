"""Small multiples."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import GridError
from tcs.kernel.arrays import BOX
from tcs.output.draw import Category, PlaceMap, Solid, StatePanel, draw_states, primitive_corners
from tests.output.draw.test_map import stand, words
from tests.placement.tables.small import random_scores, small_grid

GRID = small_grid(nx=5, ny=4, bed=2, head=3)
SCORES = random_scores(GRID, 3, seed=4, share=0.3)


@pytest.fixture
def panels():
    """Two heights by three head rest angles; the second member has the state at the top right."""
    corners = primitive_corners(BOX, (0.2, 0.1, 0.3))
    person = Solid.placed(Category.PERSON, corners, np.eye(3), [0.0, 0.3, 0.3])
    members = {5: [(2, stand(x=-0.5, y=0.3))], 0: [(1, stand(x=0.1, y=0.5))]}
    found = [
        StatePanel(PlaceMap.of_state(SCORES, GRID, state), [person], members.get(state, []))
        for state in range(6)
    ]
    return [found[3:], found[:3]]


def draw(panels, **more):
    members = [stand(x=0.1, y=0.5), stand(x=-0.5, y=0.3)]
    heads = ("head rest 0°", "head rest 35 deg", "head rest 70°")
    return draw_states(panels, ("high", "low"), heads, members=members, title="t", **more)


def meshes(figure):
    """The coloured cells of each panel."""
    return [axes.collections[1] for axes in figure.axes[:6]]


@pytest.mark.parametrize("score", ["reachability", "manipulability"])
def test_all_panels_are_coloured_in_one_scale(panels, score):
    drawn = meshes(draw(panels, score=score))
    assert len({mesh.get_clim() for mesh in drawn}) == 1
    values = [getattr(panel.places, score) for row in panels for panel in row]
    factor = 100.0 if score == "reachability" else 1.0
    for mesh, expected in zip(drawn, values, strict=True):
        np.testing.assert_array_equal(np.ma.getdata(mesh.get_array()), factor * expected.T)
    top = 100.0 if score == "reachability" else max(v.max() for v in values)
    assert drawn[0].get_clim() == (0.0, top)


def test_members_are_marked_in_the_panel_of_their_state(panels):
    figure = draw(panels)
    marked = [
        [text.get_text() for text in axes.texts if text.get_text() in ("1", "2")]
        for axes in figure.axes[:6]
    ]
    assert marked == [[], [], ["2"], ["1"], [], []]


def test_panels_show_the_same_part_of_the_floor_with_a_scale(panels):
    figure = draw(panels)
    limits = {(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes[:6]}
    assert len(limits) == 1
    wording = words(figure)
    for word in ("head rest 35 deg", "high", "0.5 m", "base x [m]", "2: x -0.50 m", "best "):
        assert word in wording


def test_the_best_of_each_state_is_the_best_of_all():
    each = [PlaceMap.of_state(SCORES, GRID, state) for state in range(6)]
    whole = PlaceMap.of(SCORES, GRID)
    for name in ("reachability", "manipulability", "free"):
        np.testing.assert_array_equal(
            np.max([getattr(one, name) for one in each], axis=0), getattr(whole, name)
        )
    assert each[0].over_words == "torso heights and headings"
    assert whole.over_words == "torso heights, headings, head rests and bed heights"


def test_there_is_no_other_state():
    with pytest.raises(GridError, match="it has 6, from 0"):
        PlaceMap.of_state(SCORES, GRID, 6)


def test_no_configuration_reaches_a_goal():
    grid = small_grid(nx=3, ny=3, head=2)
    scores = random_scores(grid, 2, seed=0, share=0.0)
    found = [StatePanel(PlaceMap.of_state(scores, grid, state), [], []) for state in range(2)]
    figure = draw_states([found], ("",), ("a", "b"), members=[], title="t", score="manipulability")
    figure.canvas.draw()
    assert words(figure).count("no goal reached") == 2
