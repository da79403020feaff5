"""Why goals are lost when the room is off."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.robustness import evaluate, losses
from tcs.tables import Reason


@pytest.fixture(scope="module")
def found(trials):
    evaluation = evaluate(trials, samples=150)
    return evaluation, losses(trials, evaluation).goals


def test_every_goal_that_is_lost_is_told_with_its_success(found):
    evaluation, told = found
    lost = {loss.goal: loss.success for loss in told}
    assert lost == {
        goal: pytest.approx(share, abs=1e-12)
        for goal, share in enumerate(evaluation.per_goal)
        if share < 1.0
    }
    assert [loss.success for loss in told] == sorted(lost.values())


def test_no_set_reaches_more_than_the_ceiling(trials):
    evaluation = evaluate(trials, samples=150)
    ceiling = losses(trials, evaluation).ceiling
    # Means of the same samples: exact but for the order of adding up.
    assert evaluation.summary.mean <= ceiling + 1e-12 <= 1.0 + 2e-12


def test_reasons_are_those_of_losses_alone(found):
    _, told = found
    assert told
    for loss in told:
        assert sum(loss.reasons.values()) == pytest.approx(1.0, abs=1e-12)
        assert Reason.REACHED not in loss.reasons
        # The base is not checked again.
        assert Reason.BODY_BLOCKED not in loss.reasons
        assert (loss.pair is None) == (loss.pair_share == 0.0)
        blocked = (Reason.GRIPPER_BLOCKED, Reason.ARM_BLOCKED)
        assert loss.pair_share <= sum(loss.reasons.get(r, 0.0) for r in blocked) + 1e-12


def test_the_joint_that_is_told_is_off_in_the_losses(trials, found):
    evaluation, told = found
    for loss in told:
        rows = ~evaluation.reached[:, loss.goal]
        off = evaluation.offsets[loss.joint]
        assert loss.tilt == pytest.approx(off[rows].mean() / off.std(), abs=1e-12)


def test_a_person_lifted_away_is_too_far(chair_trials):
    evaluation = evaluate(chair_trials, samples=4)
    away = {name: np.zeros(3) for name in evaluation.offsets}
    # The seated person's x points backwards: -0.9 m is far in front of the chair.
    away["person_x"] = np.array([0.0, -0.9, 0.9])
    found = chair_trials.outcome(int(evaluation.sets[0][0]), away)
    assert (found.reason[0] == Reason.REACHED).any()
    assert not (found.reason[1:] == Reason.REACHED).all(axis=1).any()
    assert (found.reason[1:] == Reason.TOO_FAR).any()
