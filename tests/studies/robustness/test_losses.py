"""Analysis of goals that are lost under error."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tcs.placement.robustness import evaluate
from tcs.placement.scoring.hands import HandScores
from tcs.placement.tables import Reason
from tcs_studies.robustness.losses import losses


@pytest.fixture(scope="module")
def found(trials):
    evaluation = evaluate(trials, samples=150)
    return evaluation, losses(trials, evaluation).goals


def test_every_lost_goal_is_reported_with_its_success(found):
    evaluation, goals = found
    lost = {loss.goal: loss.success for loss in goals}
    assert lost == {
        goal: pytest.approx(fraction, abs=1e-12)
        for goal, fraction in enumerate(evaluation.per_goal)
        if fraction < 1.0
    }
    assert [loss.success for loss in goals] == sorted(lost.values())


def test_no_set_reaches_more_than_the_ceiling(trials):
    evaluation = evaluate(trials, samples=150)
    ceiling = losses(trials, evaluation).ceiling
    # Means of the same samples: equal except for the order of summation.
    assert evaluation.summary.mean <= ceiling + 1e-12 <= 1.0 + 2e-12


def test_reasons_are_those_of_losses_alone(found):
    _, goals = found
    assert goals
    for loss in goals:
        assert sum(loss.reasons.values()) == pytest.approx(1.0, abs=1e-12)
        assert Reason.REACHED not in loss.reasons
        # Collisions of the base are not checked; those of the arm at rest are.
        assert loss.pair is None or loss.pair[0] != "base_link"
        assert (loss.pair is None) == (loss.pair_fraction == 0.0)
        blocked = (
            Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT,
            Reason.GRIPPER_BLOCKED_BY_ROBOT,
            Reason.ARM_BLOCKED,
            Reason.BODY_BLOCKED,
        )
        assert loss.pair_fraction <= sum(loss.reasons.get(r, 0.0) for r in blocked) + 1e-12


def test_the_reported_joint_has_a_mean_error_in_the_losses(trials, found):
    evaluation, goals = found
    for loss in goals:
        rows = ~evaluation.reached[:, loss.goal]
        errors = evaluation.offsets[loss.joint]
        assert loss.standardized_error == pytest.approx(
            errors[rows].mean() / errors.std(), abs=1e-12
        )


def test_a_person_moved_away_is_too_far(chair_trials):
    evaluation = evaluate(chair_trials, samples=4)
    away = {name: np.zeros(3) for name in evaluation.offsets}
    # The seated person's x points backwards: -0.9 m is far in front of the chair.
    away["person_x"] = np.array([0.0, -0.9, 0.9])
    found = chair_trials.outcome(int(evaluation.sets[0][0]), away).scores
    assert (found.reason[0] == Reason.REACHED).any()
    assert not (found.reason[1:] == Reason.REACHED).all(axis=1).any()
    assert (found.reason[1:] == Reason.TOO_FAR).any()


def by_hand():
    """Trials of two members in four samples with given outcomes at three goals."""
    reached, far, gripper, arm = (
        Reason.REACHED, Reason.TOO_FAR, Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT,
        Reason.ARM_BLOCKED,
    )  # fmt: skip
    # Bodies of the robot: base 0, hand 1; then a contact is robot body * 5 + other, where others
    # are bed 0, person 1, chair 2, base 3, hand 4.
    outcomes = [
        SimpleNamespace(
            reason=np.array([[reached, gripper, reached], [reached, gripper, far],
                             [arm, gripper, reached], [reached, reached, reached]]),
            contact=np.array([[-1, 5, -1], [-1, 5, -1], [6, 5, -1], [-1, -1, -1]]),
        ),
        SimpleNamespace(
            reason=np.array([[far, gripper, far], [far, far, far],
                             [arm, gripper, far], [far, far, far]]),
            contact=np.array([[-1, 5, -1], [-1, -1, -1], [8, 5, -1], [-1, -1, -1]]),
        ),
    ]  # fmt: skip
    best = np.any([found.reason == Reason.REACHED for found in outcomes], axis=0)
    lowered = SimpleNamespace(
        robot_bodies=("base", "hand"), environment_bodies=("bed", "person", "chair")
    )
    trials = SimpleNamespace(
        outcome=lambda h, offsets: HandScores(outcomes[h], np.zeros((4, 3), np.uint8)),
        hands=[SimpleNamespace(lowered=lowered)],
        task=SimpleNamespace(goals=[SimpleNamespace(body_frame="head")] * 3),
    )
    evaluation = SimpleNamespace(
        reached=best, sets=np.array([[0, 1]]), weights=np.array([0.5, 0.25, 0.25]),
        offsets={"chair_x": np.array([0.1, 0.1, 0.2, 0.0]), "person_y": np.array([1, 1, -3, 1.0])},
    )  # fmt: skip
    return trials, evaluation


def test_losses_by_hand():
    found = losses(*by_hand())
    by_goal = {loss.goal: loss for loss in found.goals}
    assert [loss.goal for loss in found.goals] == [1, 0, 2]
    assert [by_goal[g].success for g in range(3)] == [0.75, 0.25, 0.75]
    # No set can reach a goal at which the gripper touches the environment for both members: goal 1
    # in samples 0 and 2.
    assert found.ceiling == pytest.approx(1.0 - 0.25 * 2 / 4)
    assert (by_goal[0].pair, by_goal[0].pair_fraction) == (("hand", "person"), 1.0)
    assert (by_goal[1].pair, by_goal[1].pair_fraction) == (("hand", "bed"), 1.0)
    assert by_goal[2].pair is None
    assert by_goal[0].reasons == {Reason.ARM_BLOCKED: 1.0}
    assert by_goal[1].reasons == {Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT: 1.0}
    # Sample 2 loses goal 0: the error of the chair is 0.2 / 0.0707 standard deviations, that of the
    # person -3 / 1.73.
    assert by_goal[0].joint == "chair_x"
    assert by_goal[0].standardized_error == pytest.approx(2.0 * np.sqrt(2.0))


def test_the_ceiling_ignores_a_gripper_blocked_by_the_robot():
    """Another base pose may free a gripper that touches the robot's own body."""
    trials, evaluation = by_hand()
    nominal = losses(trials, evaluation).ceiling
    for outcome in (trials.outcome(h, {}).scores for h in (0, 1)):
        blocked = outcome.reason[0] == Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT
        outcome.reason[0, blocked] = Reason.GRIPPER_BLOCKED_BY_ROBOT
    # In sample 0 another base pose may reach goal 1, in sample 2 none can.
    found = losses(trials, evaluation)
    assert nominal == pytest.approx(1.0 - 0.25 * 2 / 4)
    assert found.ceiling == pytest.approx(1.0 - 0.25 * 1 / 4)
    (loss,) = (loss for loss in found.goals if loss.goal == 1)
    assert set(loss.reasons) == {
        Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT,
        Reason.GRIPPER_BLOCKED_BY_ROBOT,
    }
    for member in (0, 1):
        reason = trials.outcome(member, {}).scores.reason
        reason[reason == Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT] = Reason.GRIPPER_BLOCKED_BY_ROBOT
    assert losses(trials, evaluation).ceiling == 1.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_errors_of_either_sign_may_be_reported(sign):
    trials, evaluation = by_hand()
    evaluation.offsets = {
        "chair_x": np.array([0.1, -0.1, 0.05, 0.0]),
        "person_y": sign * np.array([1.0, 1.0, -3.0, 1.0]),
    }
    (loss,) = (loss for loss in losses(trials, evaluation).goals if loss.goal == 0)
    assert loss.joint == "person_y"
    assert loss.standardized_error == pytest.approx(-sign * 3.0 / np.sqrt(3.0))
