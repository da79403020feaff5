"""Which member serves which goal: the best of those that reach it."""

from __future__ import annotations

import dataclasses

import numpy as np

from tcs.output.words import assign_goals, assigned_goals
from tests.placement.tables.small import random_scores, small_grid


def test_the_member_with_the_greatest_dexterity_serves_a_goal():
    grid = small_grid()
    scores = random_scores(grid, 6, seed=3, share=0.5)
    members = (40, 7, 23)
    assignment = assign_goals(scores, members)
    for goal, number in enumerate(assignment):
        reached = [h for h in members if scores.reached[h, goal]]
        if number is None:
            assert not reached
            continue
        assert scores.reached[members[number], goal]
        assert scores.dexterity[members[number], goal] == max(
            scores.dexterity[h, goal] for h in reached
        )
    served = [goal for number in range(3) for goal in assigned_goals(assignment, number)]
    assert sorted(served) == [goal for goal, at in enumerate(assignment) if at is not None]


def test_a_goal_reached_without_dexterity_is_served():
    """At a singular posture the measure is 0 although the goal is reached."""
    grid = small_grid()
    scores = random_scores(grid, 2, seed=0, share=1.0)
    dexterity = np.zeros_like(scores.dexterity)
    scores = dataclasses.replace(scores, dexterity=dexterity)
    assert scores.reached[[4, 9]].all()
    # Of equal members the first in the order of the tour.
    assert assign_goals(scores, (9, 4)) == (0, 0)


def test_without_members_no_goal_is_served():
    scores = random_scores(small_grid(), 3, seed=0)
    assert assign_goals(scores, ()) == (None, None, None)
