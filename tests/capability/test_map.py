import dataclasses

import numpy as np
import pytest

from tcs.capability import MapGrid
from tcs.capability.map import CapabilityMap
from tcs.errors import StoreError, UnknownNameError


def small_map(cells, manipulability, visibility, map_type="IHCM", grid=None, **changes):
    """Return a map of a few cells at one of three torso heights."""
    cells = np.array(cells, np.int32).reshape(-1, 5)
    count = len(cells)
    made = {
        "map_type": map_type,
        "grid": grid or MapGrid.of(0.05, 16, "side+top"),
        "cells": cells,
        "manipulability": np.array(manipulability, np.float32),
        "visibility": np.array(visibility, np.float32),
        "torso_heights": np.array([0.05, 0.10, 0.15]),
        "torso_height": 0.10,
        "free_torso_heights": np.full(count, 7, np.uint32),
        "manipulability_scale": 0.1,
        "metadata": {"robot": "example"},
        "joints": np.empty((0, 7), np.float32),
    }
    return CapabilityMap(**(made | changes))


CELLS = [[0, 0, 0, 0, 0], [0, 1, 0, 0, 0], [1, 0, 0, 0, 3]]


def test_fixed_scores_divide_manipulability_by_the_greatest_of_the_arm():
    found = small_map(CELLS, [0.05, 0.1, 0.2], [1.0, 0.5, 0.0])
    np.testing.assert_allclose(found.score(), [0.75, 0.75, 0.5], rtol=1e-6)
    np.testing.assert_allclose(found.of_type("ICM").score(), [0.5, 1.0, 1.0], rtol=1e-6)


def test_thesis_scores_scale_both_linearly_within_the_map():
    found = small_map(CELLS, [0.05, 0.1, 0.15], [1.0, 0.5, 0.5])
    np.testing.assert_allclose(found.score("thesis"), [0.5, 0.25, 0.5], rtol=1e-5)


def test_a_map_of_equal_scores_can_be_scaled():
    found = small_map(CELLS, [0.1] * 3, [0.5] * 3)
    np.testing.assert_array_equal(found.score("thesis"), [1.0, 1.0, 1.0])


def test_rows_of_cells():
    found = small_map(CELLS, [0.1] * 3, [0.5] * 3)
    cells = np.array([CELLS[2], [0, 0, 0, 0, 1], CELLS[0]])
    assert found.rows_of(cells).tolist() == [2, -1, 0]
    assert small_map([], [], []).rows_of(cells).tolist() == [-1, -1, -1]


def test_look_up_takes_the_nearest_cell(ihcm, rng):
    rows = rng.integers(0, len(ihcm.cells), 200)
    R_BT, p_BT = ihcm.grid.tool_in_base(ihcm.cells[rows])
    # Less than half a step of 0.1 m along every axis of E.
    moved = p_BT + rng.uniform(-0.028, 0.028, p_BT.shape)
    np.testing.assert_array_equal(ihcm.look_up(R_BT, moved), rows)
    assert np.all(ihcm.look_up(R_BT, p_BT + 9.0) == -1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cells": np.array(CELLS[::-1], np.int32)}, "not sorted"),
        ({"cells": np.array(CELLS + CELLS, np.int32)[[0, 0, 1]]}, "not sorted"),
        ({"cells": np.array([*CELLS[:2], [2, 0, 0, 0, 0]], np.int32)}, "outside"),
        ({"cells": np.array([*CELLS[:2], [1, 0, 0, 0, 16]], np.int32)}, "outside"),
        ({"manipulability": np.array([0.1, np.nan, 0.1], np.float32)}, "manipulability"),
        ({"visibility": np.array([0.1, 1.1, 0.1], np.float32)}, "visibility"),
        ({"free_torso_heights": np.array([1], np.uint32)}, "free_torso_heights"),
        ({"torso_height": 0.12}, "torso height is not one"),
        ({"manipulability_scale": 0.0}, "scale"),
        ({"joints": np.zeros((2, 7), np.float32)}, "joints"),
    ],
)
def test_contradictions_are_refused(changes, message):
    with pytest.raises(StoreError, match=message):
        dataclasses.replace(small_map(CELLS, [0.1] * 3, [0.5] * 3), **changes)


def test_names_are_checked():
    with pytest.raises(UnknownNameError, match="ITCM"):
        small_map(CELLS, [0.1] * 3, [0.5] * 3, map_type="TCM")
    with pytest.raises(UnknownNameError, match="scale"):
        small_map(CELLS, [0.1] * 3, [0.5] * 3).score("max")


def test_maps_cannot_be_written_to():
    found = small_map(CELLS, [0.1] * 3, [0.5] * 3)
    with pytest.raises(ValueError, match="read-only"):
        found.cells[0, 0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        found.torso_height = 0.2


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"torso_heights": np.array([0.1, 1e300])}, "torso height is 1e\\+300"),
        ({"torso_heights": np.array([0.1, np.nan])}, "torso height is nan"),
        ({"torso_heights": np.array([0.1, 0.05])}, "not ascending"),
        ({"cells": [[0, 1000, 0, 0, 0]]}, "coordinate of a cell is 50 m"),
    ],
)
def test_maps_of_impossible_extent_are_refused(changes, message):
    with pytest.raises(StoreError, match=message):
        small_map(**({"cells": CELLS[:1], "manipulability": [0.1], "visibility": [0.1]} | changes))
