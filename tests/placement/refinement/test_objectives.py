"""Objectives of a refinement, on small tables with known values."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.placement.refinement.local_search import Features, ScoreObjective

WEIGHTS = np.array([0.75, 0.25])
ALONE = Features(np.array([[[True, False]]]), np.array([[[0.4, 0.0]]], np.float32))
TOGETHER = Features(
    np.array([[[True, False], [True, True]]]), np.array([[[0.4, 0.0], [0.2, 0.8]]], np.float32)
)


def test_the_score_takes_the_best_member_at_each_goal():
    objective = ScoreObjective(WEIGHTS)
    assert objective.values(ALONE)[0] == pytest.approx(0.75 + 0.3)
    assert objective.values(TOGETHER)[0] == pytest.approx(1.0 + 0.3 + 0.2)
