"""Motions from configurations at which both arms serve goals."""

from __future__ import annotations

import numpy as np
import pytest

import tcs
from tcs.model.scene import ErrorDistribution
from tcs.motion import load_plan, save_plan
from tcs.motion.plan_check import check_plan
from tcs.motion.plan_files import plan_csv
from tcs.motion.plan_success import evaluate_plan
from tests.environments import CORNER, write_environment

NONE = {"person_x": ErrorDistribution(distribution="normal", std=1e-9)}


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    corner = write_environment(tmp_path_factory.mktemp("arms"), "corner", CORNER)
    return tcs.score("shaving", corner, "pr2", arms="both", paper=True)


@pytest.fixture(scope="module")
def examined(both):
    return tcs.examine(both, within=None, jobs=1)


@pytest.fixture(scope="module")
def planned(both, examined):
    """The plan of a stop at which both arms do goals."""
    (table,) = examined.tables
    served = both.nominal.sets.served[
        np.searchsorted(both.nominal.sets.candidates, table.configurations)
    ]
    by_left, by_right = ((table.done & (served == hand)).sum(axis=1) for hand in (1, 2))
    row = int(np.argmax(np.minimum(by_left, by_right) * 100 + table.done.sum(axis=1)))
    assert min(by_left[row], by_right[row]) > 0
    return tcs.plan(both, [int(table.configurations[row])]), table.done[row]


def test_what_can_be_done_is_done_by_each_arm_in_turn(planned):
    plan, done = planned
    assert [stop.hand for stop in plan.stops] == ["left", "right"]
    assert [stop.joints[0][:2] for stop in plan.stops] == ["l_", "r_"]
    assert {result.goal for result in plan.results if result.done} == set(np.flatnonzero(done))
    assert plan.false == 0
    for result in plan.results:
        if result.done:
            assert result.goal in plan.stops[result.stop].goals


def test_a_plan_of_both_arms_is_checked_and_evaluated(planned, tmp_path):
    plan, _ = planned
    save_plan(tmp_path / "plan.json", plan)
    again = load_plan(tmp_path / "plan.json")
    assert [stop.joints for stop in again.stops] == [stop.joints for stop in plan.stops]
    found = check_plan(again)
    assert found.is_sound
    assert found.goals == plan.goals_done
    rooms = evaluate_plan(again, samples=1, errors=NONE, replan=True)
    assert rooms.blind.all()
    header = plan_csv(again).splitlines()[0].split(",")
    assert set(plan.stops[0].joints) | set(plan.stops[1].joints) <= set(header)


def test_sets_of_both_arms_are_chosen_by_what_can_be_done(both, examined):
    chosen = tcs.select(both, both.configurations.configuration(0), motions=examined)
    (table,) = examined.tables
    rows = np.searchsorted(table.configurations, chosen.indices)
    assert chosen.reachability == pytest.approx(table.done[rows].any(axis=0).mean())
