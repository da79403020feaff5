import math

import numpy as np
import pytest

from tcs.capability import (
    Grasp,
    GraspPosition,
    GraspTask,
    TaskShape,
    curved_task,
    linear_task,
    pick_and_place_task,
)
from tcs.errors import TaskError, UnknownNameError


def places(task):
    return [(round(p.x, 9), round(p.y, 9)) for p in task.positions]


def headings(position):
    return sorted(round(math.degrees(grasp.heading)) for grasp in position.grasps)


@pytest.mark.parametrize(
    ("length", "samples", "found"),
    [
        (0.15, 3, [0.0, 0.05, 0.10, 0.15]),
        (0.20, 3, [0.0, 0.10, 0.20]),
        (0.60, 4, [0.0, 0.20, 0.40, 0.60]),
        (0.35, 2, [0.0, 0.35]),
    ],
)
def test_lines_as_in_figures_16_27_and_28(length, samples, found):
    assert places(linear_task(length, samples, 0.8)) == [(0.0, y) for y in found]


def test_direction_of_a_line():
    assert places(linear_task(0.1, 2, 0.8, direction=2)) == [(0.0, 0.0), (-0.1, 0.0)]


def test_pick_and_place_has_two_positions_and_three_grasps():
    task = pick_and_place_task(0.15, 0.41, pre_grasps=(0.05,))
    assert places(task) == [(0.0, 0.0), (0.0, 0.15)]
    assert headings(task.positions[0]) == [-90, 0, 90]
    assert {p.height for p in task.positions} == {0.41}


@pytest.mark.parametrize("radius", [0.2, 0.3, 0.4, 0.5])
def test_an_arc_stays_near_its_radius_and_on_the_grid(radius):
    task = curved_task(radius, 0.0, math.pi / 2, 4, 1.0)
    xy = np.array(places(task))
    assert np.abs(np.hypot(*xy.T) - radius).max() <= 0.05
    np.testing.assert_allclose(xy / 0.05, np.round(xy / 0.05), atol=1e-9)
    # No other point of the quarter is nearer to the arc than the farthest one chosen.
    line = np.arange(0, 13) * 0.05
    other = np.abs(np.hypot(*np.meshgrid(line, line)) - radius).ravel()
    assert np.sort(other)[3] == pytest.approx(np.abs(np.hypot(*xy.T) - radius).max(), abs=1e-9)
    # In the order in which the door opens.
    assert np.all(np.diff(np.arctan2(xy[:, 1], xy[:, 0])) >= 0.0)


def test_the_gripper_is_clear_of_the_door():
    # Closed along x and opening towards +y: the hand is on the +y side (heading -90) or beyond the
    # free edge at +x (heading 180), never behind the door nor on the side of the hinge.
    task = curved_task(0.4, 0.0, math.pi / 2, 2, 1.0)
    assert headings(task.positions[0]) == [-90, 180]
    # Open along y: the side in front of the door is now at -x.
    assert headings(task.positions[-1]) == [-90, 0]


@pytest.mark.parametrize("opening", [1.0, -1.0])
@pytest.mark.parametrize("start_deg", [0.0, 30.0, 50.0, 75.0])
def test_no_gripper_comes_from_behind_the_door(start_deg, opening):
    start = math.radians(start_deg)
    task = curved_task(0.6, start, start + opening * math.pi / 2, 9, 0.8)
    for position in task.positions:
        angle = math.atan2(position.y, position.x)
        face = np.array([math.cos(angle + opening * math.pi / 2),
                         math.sin(angle + opening * math.pi / 2)])  # fmt: skip
        for grasp in position.grasps:
            hand = -np.array([math.cos(grasp.heading), math.sin(grasp.heading)])
            # At most 22.5 deg behind the plane of the door, where it is beyond its edge.
            assert hand @ face > -math.sin(math.pi / 8) - 1e-9


@pytest.mark.parametrize("step", [0.05, 0.1])
def test_all_points_within_a_step_of_the_arc_can_be_used(step):
    radius, reach = 0.6, range(0, 20)
    count = sum(abs(math.hypot(i, j) * step - radius) <= step for i in reach for j in reach)
    task = curved_task(radius, 0.0, math.pi / 2, count, 0.8, step=step)
    assert len(task.positions) == len(set(places(task))) == count
    with pytest.raises(TaskError, match=f"has {count} points within a step"):
        curved_task(radius, 0.0, math.pi / 2, count + 1, 0.8, step=step)


def test_a_door_that_opens_the_other_way_mirrors_the_grasps():
    one = curved_task(0.4, 0.0, math.pi / 2, 3, 1.0)
    two = curved_task(0.4, 0.0, -math.pi / 2, 3, 1.0)
    mirrored = [(x, -y) for x, y in places(one)]
    assert places(two) == mirrored
    for a, b in zip(one.positions, two.positions, strict=True):
        assert headings(b) == sorted(-h if h != 180 else 180 for h in headings(a))


@pytest.mark.parametrize("degrees", range(0, 360, 15))
def test_every_position_of_any_door_has_a_grasp(degrees):
    start = math.radians(degrees)
    for task in (
        curved_task(0.4, start, start + 1.5, 3, 1.0),
        curved_task(0.4, start, start - 1.5, 3, 1.0),
    ):
        assert all(position.grasps for position in task.positions)


def test_orientation_of_grasps():
    np.testing.assert_allclose(Grasp(math.pi / 2).R_FT[:, 0], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(Grasp(1.0, "top").R_FT[:, 0], [0, 0, -1], atol=1e-15)
    tilted = Grasp(0.0, (math.radians(30), 0.0)).R_FT[:, 0]
    np.testing.assert_allclose(tilted, [math.cos(math.radians(30)), 0, -0.5], atol=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: linear_task(0.01, 2, 0.8), "one step"),
        (lambda: linear_task(0.5, 1, 0.8), "2 samples"),
        (lambda: linear_task(math.nan, 2, 0.8), "one step"),
        (lambda: linear_task(500.0, 2, 0.8), "to 20 m"),
        (lambda: linear_task(0.5, 2, 80.0), "Write metres"),
        (lambda: linear_task(0.5, 2, math.inf), "not finite"),
        (lambda: linear_task(0.5, 2, 0.8, headings=()), "no grasp"),
        (lambda: curved_task(0.01, 0, 1, 3, 0.8), "radius"),
        (lambda: curved_task(0.3, 1, 1, 3, 0.8), "arc"),
        (lambda: curved_task(0.05, 0, 0.1, 9, 0.8), "fewer samples"),
        (lambda: GraspTask("none", ()), "0 positions"),
    ],
)
def test_invalid_tasks_are_refused(make, message):
    with pytest.raises(TaskError, match=message):
        make()


def test_an_unknown_approach_is_refused():
    position = GraspPosition(0, 0, 0.5, (Grasp(0.0, "above"),))
    with pytest.raises(UnknownNameError, match="'above'"):
        GraspTask("torso_height", (position,))


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        (
            TaskShape(shape="pick-and-place", height=0.4, pre_grasps=(0.05,), samples=9),
            pick_and_place_task(0.15, 0.4, pre_grasps=(0.05,)),
        ),
        (
            TaskShape(shape="linear", height=0.4, length=0.3, samples=4, direction_deg=180),
            linear_task(0.3, 4, 0.4, direction=2),
        ),
        (
            TaskShape(shape="curved", height=0.8, length=0.4, end=-1.5),
            curved_task(0.4, 0.0, -1.5, 3, 0.8),
        ),
    ],
)
def test_a_shape_by_name(shape, expected):
    assert shape.task(0.05) == expected


def test_unknown_shapes_and_directions_are_refused():
    with pytest.raises(UnknownNameError, match="unknown task 'pour'"):
        TaskShape(shape="pour", height=0.5).task(0.05)
    with pytest.raises(TaskError, match="multiple of 90"):
        TaskShape(shape="linear", height=0.5, direction_deg=45).task(0.05)
