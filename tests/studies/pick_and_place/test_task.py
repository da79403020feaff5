"""Table, cup and base poses."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import TaskError, UnknownNameError
from tcs_studies.pick_and_place.task import (
    CONDITIONS,
    ITCM_HIGH,
    ITCM_LOW,
    PLACE,
    TABLE_DEPTH,
    Condition,
    conditions_named,
    table_distance,
)


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda one: one.name)
def test_points_go_to_the_base_frame_and_back(condition):
    x, y = condition.in_base(0.3, -0.2)
    np.testing.assert_allclose(condition.in_task(x, y), (0.3, -0.2), atol=1e-12)
    np.testing.assert_allclose(condition.place - condition.cup, (*_turned(condition), 0.0))
    assert condition.over_table(*condition.cup[:2])


def _turned(condition):
    x, y = condition.in_base(*PLACE)
    return x - condition.x, y - condition.y


def test_the_place_is_15_cm_along_the_edge():
    np.testing.assert_allclose(ITCM_HIGH.place, (0.75, 0.30, 0.415))
    # The task is rotated by -90 deg: left along the edge is ahead of the robot.
    np.testing.assert_allclose(ITCM_LOW.place, (0.70, -0.45, 0.415))


@pytest.mark.parametrize(
    ("x", "y", "distance"),
    [(-0.35, 0.0, 0.25), (0.0, 0.0, -0.1), (TABLE_DEPTH, 0.0, 0.1), (-0.4, 0.075 + 0.7775, 0.5)],
)
def test_distance_from_the_table(x, y, distance):
    assert table_distance(x, y) == pytest.approx(distance)


def test_a_base_in_the_table_is_refused():
    with pytest.raises(TaskError, match=r"at least 0\.27 m"):
        Condition("near", 0.3, 0.0, 0.0)
    assert Condition("far", 0.38, 0.0, 0.0).x == 0.38


def test_conditions_by_name():
    assert conditions_named(()) == CONDITIONS
    assert conditions_named(("ITCM-low", "ITCM-low")) == (ITCM_LOW,)
    with pytest.raises(UnknownNameError, match="Did you mean 'ITCM-high'"):
        conditions_named(("ITCM-hihg",))
