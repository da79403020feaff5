from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.errors import GridError
from tcs.output.view import ViewedSet
from tcs.placement.tables import Reason
from tests.output.view.conftest import made, one_configuration
from tests.placement.tables.small import small_grid


def test_verdict_is_what_the_table_holds(bed):
    scores = bed.scores
    for index in (0, 17, bed.grid.size - 1):
        result = bed.result(index)
        assert result.configuration == bed.grid.configuration(index)
        assert result.reasons == tuple(Reason(code) for code in scores.reason[index])
        assert result.reached == tuple(np.flatnonzero(scores.reached[index]))
        assert result.reachability == pytest.approx(scores.reachability()[index])
        assert result.manipulability == pytest.approx(scores.manipulability()[index])
        for pair, named in zip(scores.pair[index], result.pairs, strict=True):
            assert named == (None if pair < 0 else scores.pair_names[pair])


def test_verdict_of_no_configuration_is_refused(bed):
    with pytest.raises(GridError, match="no configuration"):
        bed.result(bed.grid.size)


def test_line_states_each_goal_that_is_missed():
    grid = small_grid(1, 1, 1, 1)
    scores = one_configuration(
        [Reason.REACHED, Reason.TOO_FAR, Reason.ARM_BLOCKED, Reason.TOO_FAR], [-1, -1, 0, -1]
    )
    result = ViewedSet(grid, scores, (0,), None).result(0)
    assert result.line(0) == (
        "goal 1 reached; 1 of 4 goals, P_R 25%, P_M 0.125; too far: 2, 4; arm blocked: 3"
    )
    assert result.line(2).startswith(
        "goal 3 not reached: every arm posture would touch something (forearm against head); "
    )


def test_line_says_the_place_and_names_the_goals():
    grid = small_grid(1, 1, 1, 1)
    scores = one_configuration([Reason.REACHED, Reason.TOO_FAR], [-1, -1])
    result = dataclasses.replace(
        ViewedSet(grid, scores, (0,), None).result(0),
        names=("chin", "left cheek"),
        place="On the person's right, facing them.",
    )
    assert result.line(1).startswith(
        "on the person's right, facing them; goal left cheek (2) not reached: "
    )
    assert result.line(0).endswith("too far: left cheek (2)")


def test_goals_are_assigned_to_members_that_reach_them(bed):
    served = [bed.served(number) for number in range(len(bed.members))]
    together = sorted(goal for goals in served for goal in goals)
    reached = bed.scores.reached[list(bed.members)].any(axis=0)
    assert together == np.flatnonzero(reached).tolist()
    for number, goals in enumerate(served):
        best = bed.scores.dexterity[list(bed.members)].max(axis=0)
        for goal in goals:
            assert bed.scores.dexterity[bed.members[number], goal] == best[goal]


def test_a_goal_that_no_member_reaches_is_served_by_no_member():
    viewed = made(small_grid(), 4, (), share=0.3)
    reached = viewed.scores.reached
    first = int(np.flatnonzero(reached.sum(axis=1) == 1)[0])
    viewed = dataclasses.replace(viewed, members=(first,))
    assert viewed.served(0) == tuple(np.flatnonzero(reached[first]))


def test_joints_are_those_of_the_table(bed):
    index = bed.members[0]
    for goal in range(bed.goals):
        joints = bed.joints(index, goal)
        assert (joints is not None) == bed.scores.reached[index, goal]
