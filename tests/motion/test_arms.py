"""Motions from the configurations of a file of both arms."""

from __future__ import annotations

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError, TcsError
from tcs.model.grid import Grid
from tcs.placement.store import file_of_arm
from tests.environments import CORNER, write_environment


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    corner = write_environment(tmp_path_factory.mktemp("arms"), "corner", CORNER)
    return tcs.score("shaving", corner, "pr2", arms="both", approach=False)


@pytest.fixture(scope="module")
def examined(both):
    return tcs.examine(both, within=None, jobs=1)


def arm_numbers(both, configurations):
    return configurations // Grid.from_dict(both.grid).arm_size


def test_what_can_be_done_is_that_of_each_arm(both, examined):
    (table,) = examined.tables
    number = both.arms.index("right")
    right = arm_numbers(both, table.configurations) == number
    (alone,) = tcs.examine(file_of_arm(both, "right"), within=None, jobs=1).tables
    first = number * Grid.from_dict(both.grid).arm_size
    np.testing.assert_array_equal(table.configurations[right] - first, alone.configurations)
    np.testing.assert_array_equal(table.outcome[right], alone.outcome)
    # Each arm can do something, or the numbers of the other would do.
    assert table.done[right].any()
    assert table.done[~right].any()


def test_sets_of_both_arms_are_chosen_by_what_can_be_done(both, examined):
    here = Grid.from_dict(both.grid).configuration(0)
    chosen = tcs.select(both, here, motions=examined)
    (table,) = examined.tables
    rows = np.searchsorted(table.configurations, chosen.indices)
    assert chosen.reachability == pytest.approx(table.done[rows].any(axis=0).mean())


def test_a_plan_is_of_the_arm_of_its_stops(both, examined):
    (table,) = examined.tables
    right = arm_numbers(both, table.configurations) == both.arms.index("right")
    row = int(np.argmax(table.done.sum(axis=1) * right))
    number = int(table.configurations[row])
    plan = tcs.plan(both, [number])
    assert plan.stops[0].index == number
    assert all(joint.startswith("r_") for joint in plan.joints)
    done = [result.goal for result in plan.results if result.done]
    assert set(np.flatnonzero(table.done[row])) <= set(done)
    assert plan.false == 0
    left = int(table.configurations[~right][0])
    with pytest.raises(SelectionError, match=rf"{left} \(left\), {number} \(right\)"):
        tcs.plan(both, [left, number])
    with pytest.raises(TcsError, match="no configuration"):
        tcs.plan(both, [2 * number + 1000])
    here = Grid.from_dict(both.grid).configuration(0)
    with pytest.raises(SelectionError, match="--configuration"):
        tcs.plan(both, here)
