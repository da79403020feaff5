import math

import numpy as np
import pytest

from tcs.kernel.arrays import BOX
from tcs.model.grid import InitialConfiguration
from tcs.output.draw import (
    BaseFootprint,
    Category,
    PlaceMap,
    Solid,
    draw_map,
    primitive_corners,
    save_figure,
)
from tests.placement.tables.small import random_scores, small_grid

SQUARE = np.array([[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]])


def stand(x=1.0, y=2.0, yaw=0.0, **more):
    at = InitialConfiguration(base_x=x, base_y=y, base_yaw=yaw, torso=0.15, **more)
    return BaseFootprint(at, SQUARE)


@pytest.fixture
def places():
    grid = small_grid(nx=5, ny=4)
    return PlaceMap.of(random_scores(grid, 3, seed=2), grid)


@pytest.fixture
def chair():
    corners = primitive_corners(BOX, (0.2, 0.1, 0.3))
    return Solid.placed(Category.FURNITURE, corners, np.eye(3), [0.0, 0.3, 0.3])


def words(figure):
    """Every word in the picture."""
    from matplotlib.text import Text

    return " | ".join(text.get_text() for text in figure.findobj(Text))


def test_outline_turns_with_the_robot():
    turned = stand(yaw=math.pi / 2).polygon
    np.testing.assert_allclose(turned[0], [1.0 - 0.2, 2.0 + 0.3], atol=1e-15)


def test_map_says_what_it_shows(places, chair):
    figure = draw_map(
        places, [chair], [stand(), stand(x=-1.0)], here=stand(y=-1), title="Shaving", subtitle="P_R"
    )
    wording = words(figure)
    for word in ("Shaving", "base x [m]", "base y [m]", "furniture", "[%]", "P_M", "now: x 1.00 m"):
        assert word in wording
    assert "1: x 1.00 m, y 2.00 m, heading 0 deg, torso 0.15 m" in wording
    assert "2: x -1.00 m" in wording
    assert "person" not in wording


def test_map_names_the_measure(places):
    wording = words(draw_map(places, [], [], title="t", measure="inverse-condition"))
    assert "manipulability, P_M (inverse-condition)" in wording
    assert "P_M (isotropy)" in words(draw_map(places, [], [], title="t"))


def test_panels_hold_the_scores(places, chair):
    figure = draw_map(places, [chair], [], title="t")
    left, right = figure.axes[:2]
    for axes, values in ((left, 100 * places.reachability), (right, places.manipulability)):
        drawn = axes.collections[1].get_array()
        np.testing.assert_array_equal(np.ma.getdata(drawn), values.T)
        np.testing.assert_array_equal(np.ma.getmaskarray(drawn), values.T <= 0.0)


def test_members_outside_the_grid_are_in_the_picture(places):
    figure = draw_map(places, [], [stand(x=4.0, y=-3.0)], title="t")
    axes = figure.axes[0]
    assert axes.get_xlim()[1] > 4.3
    assert axes.get_ylim()[0] < -3.2


def test_axes_of_the_environment_are_reported(places):
    bed = {"environment": (("head_rest", 0.5), ("bed_height", 0.2))}
    figure = draw_map(places, [], [stand(**bed, environment_units=("rad", "m"))], title="t")
    assert "head rest 28.6 deg, bed height 0.20 m" in words(figure)


@pytest.mark.parametrize("ending", ["png", "pdf", "svg"])
def test_map_is_written(places, chair, tmp_path, ending):
    path = tmp_path / f"map.{ending}"
    save_figure(path, draw_map(places, [chair], [stand()], title="t"), dpi=40)
    start = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}[ending]
    assert path.read_bytes().startswith(start)
    assert list(tmp_path.iterdir()) == [path]


def test_no_reached_goal_and_a_single_base_position():
    grid = small_grid(nx=1, ny=1)
    scores = random_scores(grid, 3, seed=2, share=0.0)
    figure = draw_map(PlaceMap.of(scores, grid), [], [], title="t")
    figure.canvas.draw()
    assert len(figure.axes) == 4
