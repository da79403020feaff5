"""Approaches of goals that are regions: the poses through which lines are sought."""

from types import SimpleNamespace

import numpy as np

from tcs.kernel.approach import regions
from tcs.kernel.approach.sweep import ApproachLines, ReachedPairs
from tcs.kernel.rows import Rows
from tcs.kernel.scores import APPROACH_LIMITS, REACHED, TOO_FAR, new_scores


def test_every_nominal_pose_is_tried_after_the_most_dexterous_ones(monkeypatch):
    """The first nominal pose is out of reach, the second the least dexterous of all."""
    others = regions.MOST_LINES + 2
    scores = new_scores(1, 2 + others)
    scores.reason[:], scores.dexterity[0] = REACHED, np.linspace(0.1, 0.9, 2 + others)
    scores.reason[0, 0], led = TOO_FAR, []

    def only_the_second(_problem, _lines, _rows, pairs, _memory):
        led.append(int(pairs.pair[0, 1]))
        pairs.reason[:] = np.where(pairs.pair[:, 1] == 1, REACHED, APPROACH_LIMITS)

    exact = SimpleNamespace(goals=SimpleNamespace(number=2 + others))
    monkeypatch.setattr(regions, "_sampled", lambda *_: (exact, np.arange(2)))
    monkeypatch.setattr(regions, "score", lambda *_: scores)
    monkeypatch.setattr(regions, "score_approaches", only_the_second)
    one = np.zeros(1, np.int64)
    rows = Rows(one, np.zeros(1), np.zeros(1), np.zeros(1), one)
    pairs = ReachedPairs(
        np.zeros((1, 2), np.int64),
        np.full(1, APPROACH_LIMITS, np.uint8),
        np.zeros(1, np.int32),
        np.zeros(1, np.float32),
        np.zeros((1, 7), np.float32),
    )
    lines = ApproachLines(np.zeros((1, 3)), np.ones((1, 7)))
    regions._try_other_poses(None, lines, rows, pairs, None, np.zeros(1, np.int64))
    assert led == [*range(1 + others, 1 + others - regions.MOST_LINES, -1), 1]
    assert pairs.reason[0] == REACHED
    assert pairs.dexterity[0] == scores.dexterity[0, 1]
