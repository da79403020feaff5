"""The table of estimates: what it refuses, and how sets are found in it."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.placement.scoring.sets import build_sets
from tcs.placement.tables import SuccessTable
from tests.placement.tables.small import random_scores, small_grid

PARTS = {
    "members": np.array([[3, -1], [9, -1], [1, 4], [3, 9]], dtype=np.int32),
    "success": np.array([0.5, 0.25, 1.0, 0.75]),
    "low": np.array([0.4, 0.2, 0.6, 0.7]),
    "high": np.array([0.6, 0.3, 1.0, 0.8]),
    "samples": np.array([64, 64, 1024, 128], dtype=np.int32),
}


def test_sets_by_size_and_by_members():
    table = SuccessTable(**PARTS)
    assert table.sizes.tolist() == [1, 1, 2, 2]
    assert table.of_size(2).tolist() == [2, 3]
    assert [table.row_of(members) for members in ((3,), (9,), (1, 4), (3, 9))] == [0, 1, 2, 3]
    assert table.row_of((1,)) is None
    assert table.row_of((1, 4, 9)) is None
    with pytest.raises(ValueError, match="read-only"):
        table.success[0] = 1.0


def test_the_most_robust_set_has_the_greatest_lower_bound():
    grid = small_grid(nx=6, ny=4, bed=2)
    sets = build_sets(random_scores(grid, 5, seed=1, share=0.4), grid)
    a, b, c, d = (int(h) for h in sets.candidates[:4])
    members = np.array([[a, -1], [b, -1], [c, -1], [a, d]], dtype=np.int32)
    table = SuccessTable(**{**PARTS, "members": members})
    # (c,) has the greatest mean, but a wider interval.
    high, low = PARTS["high"], np.array([0.4, 0.2, 0.6, 0.7])
    assert table.most_robust(sets) == (a, d)
    assert table.most_robust(sets, max_members=1) == (c,)
    equal = SuccessTable(**{**PARTS, "members": members, "low": np.minimum(low, 0.2), "high": high})
    scores = [sum(sets.scores_of(equal.set_at(row))) for row in range(4)]
    assert equal.most_robust(sets) == equal.set_at(int(np.argmax(scores)))
    none = SuccessTable(**{name: part[:0] for name, part in PARTS.items()})
    assert none.most_robust(sets) == ()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("members", [[3, -1], [9, -1], [4, 1], [3, 9]], "ascending"),
        ("members", [[3, -1], [9, -1], [4, 4], [5, 9]], "ascending"),
        ("members", [[-1, 3], [9, -1], [1, 4], [3, 9]], "ascending"),
        ("members", [[3, -1], [9, -1], [1, 4], [1, 4]], "without duplicates"),
        ("members", [[1, 4], [9, -1], [3, -1], [3, 9]], "in order"),
        ("members", [[3, -2], [9, -1], [1, 4], [3, 9]], "ascending"),
        ("success", [0.5, 0.25, 1.1, 0.75], "low <= success"),
        ("success", [0.5, float("nan"), 1.0, 0.75], "low <= success"),
        ("low", [0.6, 0.2, 0.6, 0.7], "low <= success"),
        ("high", [0.6, 0.3, 1.0, 1.8], "<= 1 must hold"),
        ("samples", [64, 64, 0, 128], "samples must be positive"),
        ("samples", [64, 64, 1], "has shape"),
    ],
)
def test_contradictory_arguments_are_refused(name, value, message):
    wrong = np.array(value, dtype=PARTS[name].dtype)
    with pytest.raises(TcsError, match=message):
        SuccessTable(**{**PARTS, name: wrong})
