"""Narrow windows of the free joint that limits and contacts leave open, in real environments."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import score as scores_of
from tcs.kernel.verification.dense import DENSE_SAMPLES
from tcs.kernel.verification.scans import dense_scan
from tcs.placement.scoring import load_job
from tests.kernel.judge import is_true

# Configuration and goal of feeding. Every sample but those next to a limit touches something.
NEXT_TO_A_LIMIT = [
    (86787, 3), (64777, 1), (64071, 5), (73541, 5), (80859, 5), (58945, 2), (61873, 1), (63310, 2),
    (79465, 5),
]  # fmt: skip
# Of shaving, with TIAGo. The wrist is nearly straight, and joints 5 and 7 rotate by half a turn.
STRAIGHT_WRIST = [(50114, 6), (51599, 6), (64780, 5), (69101, 5), (81542, 4)]
# Joints 5 and 7 move 2.8 rad while joint 1 all but rests.
RESTING_JOINT = [(53000, 6), (57313, 6), (72059, 5)]
# Windows that limits leave, narrower than the samples are apart.
THIN = [(70622, 7), (76574, 7)]
# Of shaving, with the iiwa 7. The arm is all but stretched, 0.33 rad from its limits.
STRETCHED = [(24248, 5)]


def problem_of(task, environment, robot="pr2"):
    job = load_job(task, environment, robot, paper=True)
    lowered = job.lowered(job.scene())
    return build_problem(lowered.arrays), lowered.grid


@pytest.fixture(scope="module")
def feeding():
    return problem_of("feeding", "wheelchair")


@pytest.fixture(scope="module")
def shaving_with_iiwa7():
    return problem_of("shaving", "wheelchair", "iiwa7")


@pytest.fixture(scope="module")
def shaving_with_tiago():
    return problem_of("shaving", "wheelchair", "tiago")


@pytest.mark.parametrize(("h", "g"), NEXT_TO_A_LIMIT, ids=str)
def test_an_interval_between_a_contact_and_a_limit_is_found(feeding, h, g):
    check(feeding, h, g)


@pytest.mark.parametrize(("h", "g"), STRAIGHT_WRIST, ids=str)
def test_a_window_at_a_straight_wrist_is_found(shaving_with_tiago, h, g):
    check(shaving_with_tiago, h, g)


@pytest.mark.parametrize(("h", "g"), RESTING_JOINT, ids=str)
def test_a_window_in_which_joints_run_fast_is_found(shaving_with_tiago, h, g):
    check(shaving_with_tiago, h, g)


@pytest.mark.parametrize(("h", "g"), THIN, ids=str)
def test_a_window_narrower_than_the_dense_scan_is_found(shaving_with_tiago, h, g):
    problem, grid = shaving_with_tiago
    scores = scores_of(problem, rows_at(grid, [h]))
    assert scores.reason[0, g] == REACHED
    # The dense scan may step over it; the reference judges the solution itself.
    job = load_job("shaving", "wheelchair", "tiago", paper=True)
    lowered = job.lowered(job.scene())
    assert is_true(lowered.arrays, lowered.grid, h, g, scores.joints[0, g])


@pytest.mark.parametrize(("h", "g"), STRETCHED, ids=str)
def test_a_window_of_the_stretched_arm_is_found(shaving_with_iiwa7, h, g):
    check(shaving_with_iiwa7, h, g)


def check(scored, h, g):
    """Score one pair, and compare it with the dense scan."""
    problem, grid = scored
    scores = scores_of(problem, rows_at(grid, [h]))
    q = np.empty(7)
    best = dense_scan(problem, rows_at(grid, [h]), g, DENSE_SAMPLES, q)
    assert best > 0.0
    assert scores.reason[0, g] == REACHED
    # As wide as a window is, isotropy changes by less than this across it.
    assert scores.dexterity[0, g] == pytest.approx(best, abs=2e-3)
