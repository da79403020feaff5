"""Calls shared by processes: their results, and no warning where one is replaced."""

import warnings
from operator import mul

import pytest
from joblib import delayed

from tcs_shapes import processes


def warned(number):
    warnings.warn(
        f"{processes._REPLACED}. This can be caused by a leak.", UserWarning, stacklevel=1
    )
    return number


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_are_in_the_order_of_the_calls(jobs):
    assert processes.ordered(jobs, (delayed(mul)(n, n) for n in range(9))) == [
        n * n for n in range(9)
    ]


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_result_comes_once(jobs):
    found = processes.unordered(jobs, (delayed(mul)(n, n) for n in range(9)))
    assert sorted(found) == [n * n for n in range(9)]


def test_that_a_process_is_replaced_is_no_news():
    # Warnings are errors in the tests.
    assert processes.ordered(1, [delayed(warned)(3)]) == [3]
    assert list(processes.unordered(1, [delayed(warned)(4)])) == [4]
    with pytest.warns(UserWarning, match="worker stopped"):
        warned(5)
