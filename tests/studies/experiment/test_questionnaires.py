"""Questionnaires: the positive end of each scale, and invalid answers."""

from __future__ import annotations

import pytest

from tcs.errors import DataFileError
from tcs_studies.experiment.questionnaires import TLX_DIMENSIONS, van_der_laan, weighted_workload


def test_best_and_worst_answers():
    best = [1, 1, 5, 1, 1, 5, 1, 5, 1]
    found = van_der_laan(best)
    assert (found.usefulness, found.satisfaction) == (2.0, 2.0)
    found = van_der_laan([6 - tick for tick in best])
    assert (found.usefulness, found.satisfaction) == (-2.0, -2.0)


@pytest.mark.parametrize("item", range(1, 10))
def test_each_item_counts_for_its_scale_alone_and_the_right_way_round(item):
    neutral = [3] * 9
    ticks = neutral.copy()
    ticks[item - 1] = 1
    sign = -1 if item in (3, 6, 8) else 1
    found = van_der_laan(ticks)
    if item % 2:
        assert (found.usefulness, found.satisfaction) == (sign * 2 / 5, 0.0)
    else:
        assert (found.usefulness, found.satisfaction) == (0.0, sign * 2 / 4)


@pytest.mark.parametrize("ticks", [[3] * 8, [3] * 10, [3] * 8 + [0], [3] * 8 + [6]])
def test_invalid_answers_are_refused(ticks):
    with pytest.raises(DataFileError, match="van der Laan"):
        van_der_laan(ticks)


def test_workload_by_hand():
    ratings = dict(zip(TLX_DIMENSIONS, (12, 3, 8, 5, 14, 9), strict=True))
    weights = dict(zip(TLX_DIMENSIONS, (5, 0, 2, 3, 4, 1), strict=True))
    # (60 * 5 + 15 * 0 + 40 * 2 + 25 * 3 + 70 * 4 + 45 * 1) / 15
    assert weighted_workload(ratings, weights) == pytest.approx(780 / 15)
    assert weighted_workload(dict.fromkeys(TLX_DIMENSIONS, 20), weights) == 100.0
    assert weighted_workload(dict.fromkeys(TLX_DIMENSIONS, 0), weights) == 0.0


def test_workload_refuses_a_form_filled_in_wrongly():
    ratings = dict.fromkeys(TLX_DIMENSIONS, 10)
    weights = dict(zip(TLX_DIMENSIONS, (5, 4, 3, 2, 1, 0), strict=True))
    with pytest.raises(DataFileError, match="add up to 14"):
        weighted_workload(ratings, {**weights, "mental demand": 4})
    with pytest.raises(DataFileError, match="rating of effort is 21; must be 0 to 20"):
        weighted_workload({**ratings, "effort": 21}, weights)
    with pytest.raises(DataFileError, match="must be of each of: mental demand"):
        weighted_workload({"effort": 3}, weights)
