"""Orders of the conditions: the papers' ones, and the balance of the others."""

from __future__ import annotations

import itertools
from collections import Counter

import pytest

from tcs_studies.experiment.order import counterbalanced_orders


def test_two_conditions_have_the_papers_table():
    # Table I: subject 2k-1 begins with condition 1, subject 2k with condition 2.
    assert counterbalanced_orders((1, 2)) == ((1, 2), (2, 1))


def test_three_conditions_have_six_orders_for_the_six_participants_of_the_thesis():
    found = counterbalanced_orders("ABC")
    assert sorted(found) == sorted(itertools.permutations("ABC"))


@pytest.mark.parametrize("n", range(1, 10))
def test_each_condition_is_equally_often_at_each_place_and_after_each_other(n):
    orders = counterbalanced_orders(range(n))
    assert all(sorted(order) == list(range(n)) for order in orders)
    places = Counter((place, one) for order in orders for place, one in enumerate(order))
    after = Counter(pair for order in orders for pair in itertools.pairwise(order))
    assert set(places.values()) == {len(orders) // n}
    assert len(after) == n * (n - 1)
    assert len(set(after.values())) <= 1
