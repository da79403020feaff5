"""Members of a walk that add nothing."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.placement.refinement.local_search import (
    Evaluated,
    ScoreObjective,
    Walk,
    without_idle_members,
)

WEIGHTS = np.array([0.5, 0.5])


def walk_of(dexterity):
    dexterity = np.array(dexterity, dtype=np.float32)
    count = len(dexterity)
    reached = dexterity > 0.0
    present = Evaluated(
        np.arange(count, dtype=np.float64)[:, None],
        *(reached, dexterity, np.zeros((count, 2, 7)), np.zeros((count, 2), np.uint8)),
        *(reached, dexterity),
    )
    value = (reached.any(axis=0) + dexterity.max(axis=0)) @ WEIGHTS
    return Walk(tuple(range(10, 10 + count)), present, float(value), 0.25)


def test_members_that_add_nothing_are_left_out():
    walk = walk_of([[0.1, 0.2], [0.3, 0.2], [0.0, 0.1]])
    fewer = without_idle_members(walk, ScoreObjective(WEIGHTS))
    assert fewer.origin == (11,)
    assert fewer.value == pytest.approx(walk.value)
    np.testing.assert_array_equal(fewer.present.values, [[1.0]])


def test_members_that_add_something_stay():
    walk = walk_of([[0.3, 0.1], [0.0, 0.2]])
    assert without_idle_members(walk, ScoreObjective(WEIGHTS)) is walk
    single = walk_of([[0.3, 0.1]])
    assert without_idle_members(single, ScoreObjective(WEIGHTS)) is single


def test_members_stay_where_the_condition_needs_them():
    walk = walk_of([[0.1, 0.2], [0.3, 0.2], [0.0, 0.1]])
    found = without_idle_members(
        walk, ScoreObjective(WEIGHTS), lambda sets: np.array([len(s) > 1 for s in sets])
    )
    # The first to go is the first without which nothing is lost.
    assert found.origin == (11, 12)
