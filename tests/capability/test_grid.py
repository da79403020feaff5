import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tcs.capability.grid import GRASPS, MapGrid, angle_of, yaw_rotation
from tcs.errors import GridError, UnknownNameError


def random_cells(grid, count, rng):
    return np.column_stack(
        [
            rng.integers(0, len(grid.tilts), count),
            rng.integers(-40, 41, (count, 3)),
            rng.integers(0, grid.yaw_bins, count),
        ]
    )


@pytest.mark.parametrize("grasps", GRASPS)
def test_the_pose_of_a_cell_is_nearest_to_that_cell(grasps, rng):
    grid = MapGrid.of(0.05, 16, grasps)
    cells = random_cells(grid, 500, rng)
    near = grid.nearest(*grid.tool_in_base(cells))
    np.testing.assert_array_equal(near.cells, cells)
    # Rounding of a few products of metres.
    assert np.abs(near.offset).max() < 1e-12
    assert near.angle.max() < 1e-7


def test_base_in_tool_is_the_inverse_of_tool_in_base(rng):
    grid = MapGrid.of(0.05, 16, "all")
    cells = random_cells(grid, 200, rng)
    (R_BT, p_BT), (R_TB, p_TB) = grid.tool_in_base(cells), grid.base_in_tool(cells)
    np.testing.assert_allclose(R_BT @ R_TB, np.broadcast_to(np.eye(3), R_BT.shape), atol=1e-12)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", R_BT, p_TB) + p_BT, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("grasps", "tilts"), [("side", 1), ("top", 1), ("side+top", 2), ("all", 114)]
)
def test_tilts_of_named_grasps(grasps, tilts):
    assert len(MapGrid.of(0.05, 16, grasps).tilts) == tilts


def test_the_fingers_of_a_top_grasp_point_down():
    R_ET = MapGrid.of(grasps="top").R_ET[0]
    np.testing.assert_allclose(R_ET[:, 0], [0, 0, -1], atol=1e-15)


def test_every_orientation_is_within_half_a_cell_of_the_grid(rng):
    grid = MapGrid.of(0.05, 16, "all")
    R = Rotation.random(5000, rng=rng).as_matrix()
    near = grid.nearest(R, rng.uniform(-1, 1, (5000, 3)))
    assert np.abs(near.offset).max() <= 0.025 + 1e-12
    # Half a yaw step each in pitch, roll and yaw bounds the angle.
    assert near.angle.max() < 1.5 * grid.yaw_step
    R_BT, _ = grid.tool_in_base(near.cells)
    np.testing.assert_allclose(angle_of(np.swapaxes(R_BT, 1, 2) @ R), near.angle, atol=1e-6)


def test_the_nearest_tilt_is_the_nearest_of_all(rng):
    grid = MapGrid.of(0.05, 8, "all")
    R = Rotation.random(50, rng=rng).as_matrix()
    tilt, heading = grid.nearest_tilts(R)
    angles = np.linspace(-np.pi, np.pi, 721)
    for i in range(50):
        grids = yaw_rotation(angles)[None] @ grid.R_ET[:, None]
        gaps = angle_of((np.swapaxes(grids, -1, -2) @ R[i]).reshape(-1, 3, 3))
        found = angle_of(
            (yaw_rotation(heading[i : i + 1]) @ grid.R_ET[tilt[i]]).swapaxes(1, 2) @ R[i]
        )
        assert found[0] <= gaps.min() + 1e-9


@given(
    st.lists(st.tuples(st.integers(0, 113), *[st.integers(-4000, 4000)] * 3, st.integers(0, 15)))
)
def test_keys_sort_as_cells_do_and_convert_back(rows):
    grid = MapGrid.of(0.05, 16, "all")
    cells = np.array(sorted(rows), dtype=np.int32).reshape(-1, 5)
    keys = grid.keys(cells)
    assert np.all(np.diff(keys) >= 0)
    np.testing.assert_array_equal(grid.cells_of(keys), cells)


@pytest.mark.parametrize(
    ("step", "yaw_bins", "words"),
    [
        (0.0, 16, "step"),
        (math.nan, 16, "step"),
        (0.05, 6, "multiple of 4"),
        (0.05, 0, "yaw bins"),
        (0.05, 1024, "from 4 to 1020"),
    ],
)
def test_invalid_grids_are_refused(step, yaw_bins, words):
    with pytest.raises(GridError, match=words):
        MapGrid.of(step, yaw_bins)


def test_a_tilt_beyond_one_turn_is_refused():
    with pytest.raises(GridError, match="beyond one turn"):
        MapGrid(0.05, 16, ((0, 10**30),))


def test_unknown_grasps_are_refused():
    with pytest.raises(UnknownNameError, match="'sides'"):
        MapGrid.of(grasps="sides")


def test_a_cell_beyond_the_range_of_keys_is_refused():
    with pytest.raises(GridError, match="beyond"):
        MapGrid.of().keys(np.array([[0, 5000, 0, 0, 0]]))
