"""Narrow windows of the free joint that limits and contacts leave open, in real environments."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.problem import build_problem
from tcs.kernel.scores import REACHED, Scores
from tcs.kernel.sweep import gripper_contacts, score_slice
from tcs.kernel.verification.dense import DENSE_SAMPLES, dense_scan
from tcs.placement.scoring import load_job

# Configuration and goal of scratching the right thigh. The PR2's shoulder lift leaves its lower
# limit just before the wrist flex meets its own: windows of 4e-4 to 2.5e-3 rad.
BETWEEN_LIMITS = [
    (663388, 1), (1126360, 1), (320451, 1), (419797, 1), (621037, 1), (680582, 0),
]  # fmt: skip
# Of feeding. Every sample but those next to a limit touches something.
NEXT_TO_A_LIMIT = [
    (86787, 3), (64777, 1), (64071, 5), (73541, 5), (80859, 5), (58945, 2), (61873, 1), (63310, 2),
    (79465, 5),
]  # fmt: skip
# Of shaving, with TIAGo. The wrist is nearly straight, and joints 5 and 7 rotate by half a turn.
STRAIGHT_WRIST = [(50114, 6), (51599, 6), (64780, 5), (69101, 5), (81542, 4)]


def problem_of(task, environment, robot="pr2"):
    job = load_job(task, environment, robot)
    lowered = job.lowered(job.scene())
    return build_problem(lowered.arrays, lowered.grid)


@pytest.fixture(scope="module")
def scratching():
    return problem_of("scratching_thigh_right", "bed")


@pytest.fixture(scope="module")
def feeding():
    return problem_of("feeding", "wheelchair")


@pytest.fixture(scope="module")
def shaving_with_tiago():
    return problem_of("shaving", "wheelchair", "tiago")


@pytest.mark.parametrize(("h", "g"), BETWEEN_LIMITS, ids=str)
def test_a_window_between_two_limits_is_found(scratching, h, g):
    check(scratching, h, g)


@pytest.mark.parametrize(("h", "g"), NEXT_TO_A_LIMIT, ids=str)
def test_an_interval_between_a_contact_and_a_limit_is_found(feeding, h, g):
    check(feeding, h, g)


@pytest.mark.parametrize(("h", "g"), STRAIGHT_WRIST, ids=str)
def test_a_window_at_a_straight_wrist_is_found(shaving_with_tiago, h, g):
    check(shaving_with_tiago, h, g)


def check(problem, h, g):
    """Score one pair, and compare it with the dense scan."""
    goals = problem.goal_p.shape[1]
    scores = Scores(
        reason=np.empty((1, goals), np.uint8),
        contact=np.empty((1, goals), np.int32),
        dexterity=np.zeros((1, goals), np.float32),
        joints=np.zeros((1, goals, 7), np.float32),
    )
    score_slice(problem, gripper_contacts(problem), h, h + 1, scores)
    q = np.empty(7)
    best = dense_scan(problem, h, g, DENSE_SAMPLES, q)
    assert best > 0.0
    assert scores.reason[0, g] == REACHED
    # As wide as a window is, isotropy changes by less than this across it.
    assert scores.dexterity[0, g] == pytest.approx(best, abs=2e-3)
