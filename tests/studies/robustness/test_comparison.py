"""The four methods of Table III."""

from __future__ import annotations

import json

import pytest

from tcs_studies.robustness.comparison import METHODS, compare_methods


def test_one_and_two_with_and_without(bed_trials):
    table = compare_methods(bed_trials, samples=60)
    assert tuple(table.paired) == METHODS
    assert len(table.contrasts) == 4
    for contrast in table.contrasts:
        first, second = table.paired[contrast.first], table.paired[contrast.second]
        assert contrast.paired.mean == pytest.approx(first.summary.mean - second.summary.mean)
        assert contrast.independent.mean != contrast.paired.mean
    assert json.dumps(table.to_json())
