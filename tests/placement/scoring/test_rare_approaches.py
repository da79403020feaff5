"""Approaches that lie next to limits, which a dense search has found free and Drake confirms."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.sweep import score
from tcs.motion.approach_check import ApproachScene
from tcs.placement.scoring import load_job
from tcs.placement.scoring.approaches import ApproachScorer, approach_lines
from tcs.placement.tables import Reason

FREE = {
    # A joint at its limit at the goal that rests there; the elbow at its velocity limit; a line
    # from a narrow window at the goal past the fold between two branches.
    "pr2": [(65556, 0), (65748, 4), (77840, 6)],
    "tiago": [(55322, 2), (80125, 3)],
}


@pytest.mark.slow
@pytest.mark.parametrize("robot", FREE)
def test_approaches_next_to_limits_are_found_and_true(robot):
    job = load_job("shaving", "wheelchair", robot, paper=True)
    scene = job.scene()
    lowered = job.lowered(scene)
    problem = build_problem(lowered.arrays)
    scorer, check = (
        ApproachScorer(problem, approach_lines(job)),
        ApproachScene.of(job, scene, lowered),
    )
    for number, goal in FREE[robot]:
        rows = rows_at(lowered.grid, [number])
        scores = score(problem, rows)
        assert scores.reason[0, goal] == Reason.REACHED
        scorer.score_rows(problem, rows, scores)
        assert scores.reason[0, goal] == Reason.REACHED
        finding = check.check(number, goal, scores.joints[0, goal].astype(np.float64))
        assert finding is not None
        assert finding.is_true
