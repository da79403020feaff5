import dataclasses

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.placement.tables.sets import Groups


def parts():
    """Two groups of three members, five candidates in three cells."""
    return {
        "least": 0.25,
        "cells": np.array([[0, 0, 1], [0, 1, 2]], dtype=np.int32),
        "count": np.array([2, 1]),
        "reachability": np.array([1.0, 0.5]),
        "manipulability": np.array([0.5, 0.375], dtype=np.float32),
        "total": np.array([1.5, 0.875], dtype=np.float32),
        "member_reachability": np.array([1.0, 1.0, 0.5, 0.5, 0.0]),
        "member_manipulability": np.array([0.5, 0.5, 0.375, 0.375, 0.0], dtype=np.float32),
        "member_total": np.array([1.5, 1.5, 0.875, 0.875, 0.0], dtype=np.float32),
    }


SIZE = np.array([2, 2, 1])


def test_counts_and_is_read_only():
    groups = Groups(**parts())
    groups.check(SIZE)
    assert groups.kept == 3
    for field in dataclasses.fields(groups):
        array = getattr(groups, field.name)
        if isinstance(array, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0


WRONG = {
    "least": ({"least": float("nan")}, "least"),
    "descending": ({"cells": np.array([[0, 1, 0], [0, 1, 2]], dtype=np.int32)}, "ascending"),
    "beyond": ({"cells": np.array([[0, 0, 1], [0, 1, 3]], dtype=np.int32)}, r"within 0\.\.2"),
    "order": ({"cells": np.array([[0, 1, 2], [0, 0, 1]], dtype=np.int32)}, "lexicographic"),
    "twice": ({"cells": np.array([[0, 1, 2], [0, 1, 2]], dtype=np.int32)}, "lexicographic"),
    "too many": ({"count": np.array([2, 5])}, "count"),
    "none": ({"count": np.array([0, 1])}, "count"),
    "bound": ({"total": np.array([np.inf, 0.0], dtype=np.float32)}, "total"),
    "type": ({"total": np.array([1.5, 0.875])}, "float32"),
    "length": ({"count": np.array([1])}, "shape"),
    "members": (
        {
            name: parts()[name][:4]
            for name in ("member_reachability", "member_manipulability", "member_total")
        },
        "a bound for each candidate",
    ),
}


@pytest.mark.parametrize(("changes", "message"), WRONG.values(), ids=WRONG.keys())
def test_refuses(changes, message):
    with pytest.raises(TcsError, match=message):
        Groups(**(parts() | changes)).check(SIZE)
