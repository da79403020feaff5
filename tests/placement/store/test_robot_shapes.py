import numpy as np
import pytest

from tcs.errors import StoreError
from tcs.placement.store.robot_shapes import RobotShapes
from tests.placement.selection.test_admission import made_up_robot
from tests.placement.store.example import METADATA, score_file
from tests.placement.tables.small import small_grid


def test_round_trip_through_the_metadata():
    robot = made_up_robot()
    metadata = {**METADATA, "robot_shapes": robot.to_dict()}
    file = score_file(grid=small_grid(torsos=1), metadata=metadata)
    again = file.robot_shapes
    for name in ("chain_R", "chain_p", "arm_base_R", "arm_base_p", "torso_shift", "margin"):
        np.testing.assert_array_equal(getattr(again, name), getattr(robot, name))
    for part in ("arm", "body"):
        for name in ("type", "size", "pad", "frame", "R", "p"):
            found, expected = (getattr(getattr(r, part), name) for r in (again, robot))
            np.testing.assert_array_equal(found, expected)
    assert score_file().robot_shapes is None
    with pytest.raises(StoreError, match="has 1 torso levels; the grid has 2"):
        _ = score_file(metadata=metadata).robot_shapes


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"margin": -1.0}, "margin must be a number"),
        ({"chain_R": [0.0] * 71}, "'chain_R' must be a list of finite numbers"),
        ({"torso_shift": [0.0, float("nan"), 0.0]}, "'torso_shift' must be"),
        ({"torso_shift": [0.0] * 4}, "'torso_shift' must be"),
        ({"arm": None}, "must have 'arm' and 'body'"),
        ({"body": {"type": [1]}}, "'size' must be"),
    ],
)
def test_malformed_shapes_are_refused(changes, message):
    with pytest.raises(StoreError, match=message):
        RobotShapes.from_dict({**made_up_robot().to_dict(), **changes})


@pytest.mark.parametrize(
    ("column", "values", "message"),
    [
        ("type", [0, 3], "unknown type"),
        ("type", [0], "differ in length"),
        ("frame", [1, 8], "a part that the robot does not have"),
        ("size", [-1.0] * 6, "a size is negative"),
    ],
)
def test_malformed_columns_are_refused(column, values, message):
    plain = made_up_robot().to_dict()
    plain["arm"][column] = values
    with pytest.raises(StoreError, match=message):
        RobotShapes.from_dict(plain)
