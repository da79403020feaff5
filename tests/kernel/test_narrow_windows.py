"""Windows of the free joint that two limits leave open between them, on the real bed."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.dense import DENSE_SAMPLES, dense_scan
from tcs.kernel.pairs import REACHED
from tcs.kernel.problem import build_problem
from tcs.kernel.sweep import Scores, gripper_contacts, score_slice
from tcs.scoring import load_job

# Configuration and goal of scratching the right thigh. The PR2's shoulder lift leaves its lower
# limit just before the wrist flex meets its own: windows of 4e-4 to 2.5e-3 rad.
NARROW = [(663388, 1), (1126360, 1), (320451, 1), (419797, 1), (621037, 1), (680582, 0)]


@pytest.fixture(scope="module")
def problem():
    job = load_job("scratching_thigh_right", "bed", "pr2")
    lowered = job.lowered(job.scene())
    return build_problem(lowered.arrays, lowered.grid)


@pytest.mark.parametrize(("h", "g"), NARROW, ids=str)
def test_a_window_between_two_limits_is_found(problem, h, g):
    goals = problem.goal_p.shape[1]
    scores = Scores(
        reason=np.empty((1, goals), np.uint8),
        contact=np.empty((1, goals), np.int32),
        isotropy=np.zeros((1, goals), np.float32),
        joints=np.zeros((1, goals, 7), np.float32),
    )
    score_slice(problem, gripper_contacts(problem), h, h + 1, scores)
    q = np.empty(7)
    best = dense_scan(problem, h, g, DENSE_SAMPLES, q)
    assert best > 0.0
    assert scores.reason[0, g] == REACHED
    # As wide as a window is, isotropy changes by less than this across it.
    assert scores.isotropy[0, g] == pytest.approx(best, abs=2e-3)
