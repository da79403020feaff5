import pathlib
import tracemalloc

import numpy as np
import pytest

from tcs.errors import StoreError
from tcs.files.plain import plain


def test_copies_plain_containers():
    value = {"a": [1, 2.5, None, True, "x"], "b": {"c": (1, [2])}}
    copy = plain("metadata", value)
    assert copy == value
    assert copy["a"] is not value["a"]
    assert isinstance(copy["b"]["c"], tuple)


def test_numpy_numbers_become_python_numbers():
    copy = plain("metadata", [np.float64(0.5), np.int32(3), np.bool_(True), np.str_("x")])
    assert [type(value) for value in copy] == [float, int, bool, str]
    assert copy == [0.5, 3, True, "x"]


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({"made": {"by": pathlib.PurePosixPath("x")}}, r"metadata\.made\.by is PurePosixPath"),
        ([1, object()], r"metadata\[1\] is object"),
        (np.zeros(3), "metadata is ndarray"),
        ({1: "x"}, "keys must be text"),
    ],
)
def test_refuses_anything_else(value, message):
    with pytest.raises(StoreError, match=message):
        plain("metadata", value)


def test_a_value_that_contains_itself_is_refused():
    loop = []
    loop.append(loop)
    with pytest.raises(StoreError, match="levels or"):
        plain("metadata", loop)


def test_a_value_that_expands_to_billions_is_refused():
    value = ["x"]
    for _ in range(30):
        value = [value, value]
    with pytest.raises(StoreError, match="levels or"):
        plain("metadata", value)


def test_a_long_key_is_not_copied_for_each_of_its_values():
    # Within a file of a megabyte, the names of the values would take a terabyte in all.
    value = {"k" * 10**6: [0] * 3}
    tracemalloc.start()
    assert plain("metadata", value) == value
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 1e6
