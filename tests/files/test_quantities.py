"""Physical ranges: what each quantity admits, and that the documentation states the same."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tcs.errors import TaskError
from tcs.files.quantities import ENTRIES, POSITION, QUANTITIES, SIZE

ODD = [math.nan, math.inf, -math.inf, 1e308, -1e308, 10**400, True, None, "1", [1.0]]


@pytest.mark.parametrize("quantity", QUANTITIES, ids=lambda q: f"{q.name} [{q.unit}]")
def test_both_ends_are_in_the_range_and_nothing_beyond(quantity):
    assert quantity.admits(quantity.low)
    assert quantity.admits(quantity.high)
    assert not quantity.admits(np.nextafter(quantity.low, -math.inf))
    assert not quantity.admits(np.nextafter(quantity.high, math.inf))
    for value in ODD:
        assert not quantity.admits(value)
        assert "\n" not in quantity.fault(value)


def test_numbers_of_numpy_count():
    assert SIZE.admits(np.float32(0.5))
    assert SIZE.admits(np.int64(2))


def test_a_fault_names_value_quantity_range_and_place():
    with pytest.raises(TaskError) as caught:
        POSITION.check((0.0, 1e3), "goal 3: x", TaskError)
    assert str(caught.value) == "goal 3: x is 1000 m, but a position must be -40 to 40 m."
    assert ENTRIES.fault(1001) == "1001, but a number of entries must be 0 to 1,000"


def test_the_page_lists_every_range():
    page = (Path(__file__).parents[2] / "docs" / "files.md").read_text(encoding="utf-8")
    for quantity in QUANTITIES:
        row = f"| {quantity.name} | {quantity.span} | {quantity.covers} | {quantity.reason} |"
        assert row in page
