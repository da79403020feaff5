import numpy as np
import pytest

from tcs.capability import MapGrid, Reach, map_from_ik
from tcs.capability.from_ik import cells_around, manipulability_scale
from tcs.errors import GridError, RobotError, UnknownNameError
from tcs.kernel.dexterity import MEASURES
from tcs.model.robots import load_robot


def test_a_reached_cell_is_confirmed_by_drake(ihcm, reach, rng):
    """Forward kinematics, limits and clearances by Drake for postures of random cells."""
    scene = reach.scene
    rows = rng.choice(len(ihcm.cells), 60, replace=False)
    R_BT, p_BT = ihcm.grid.tool_in_base(ihcm.cells[rows])
    before = scene.positions()
    lower, upper = scene.arm_limits
    try:
        scene.place_base(0.0, 0.0, 0.0)
        scene.set_torso(ihcm.torso_height)
        for row, R, p in zip(rows, R_BT, p_BT, strict=True):
            q = ihcm.joints[row].astype(float)
            scene.set_arm(q)
            assert np.all((q >= lower) & (q <= upper))
            X_BT = scene.tool_pose()
            # Joints are stored in single precision: 1e-7 rad at a distance of 1 m.
            np.testing.assert_allclose(X_BT.translation(), p, atol=1e-6)
            np.testing.assert_allclose(X_BT.rotation().matrix(), R, atol=1e-6)
            assert scene.violations() == ()
    finally:
        scene.restore(before)


def test_free_torso_heights_are_those_at_which_drake_finds_nothing(ihcm, reach, rng):
    scene, before = reach.scene, reach.scene.positions()
    rows = rng.choice(len(ihcm.cells), 40, replace=False)
    some_blocked = False
    try:
        for row in rows:
            scene.set_arm(ihcm.joints[row].astype(float))
            for bit, torso_height in enumerate(ihcm.torso_heights):
                scene.set_torso(float(torso_height))
                free = bool(int(ihcm.free_torso_heights[row]) >> bit & 1)
                some_blocked |= not free
                assert free == (scene.violations() == ())
    finally:
        scene.restore(before)
    # Otherwise all of these cells are free; other cells of this map are not.
    assert some_blocked or np.all(ihcm.free_torso_heights[rows] == ihcm.free_torso_heights.max())
    assert len(np.unique(ihcm.free_torso_heights)) > 1


def test_every_cell_is_free_at_the_torso_height_the_map_was_made_at(ihcm):
    level = int(np.flatnonzero(ihcm.torso_heights == ihcm.torso_height)[0])
    assert np.all(ihcm.free_torso_heights >> np.uint32(level) & 1)


def test_a_cell_that_is_not_in_the_map_is_not_reached(ihcm, tiago):
    at = Reach(tiago, torso_height=ihcm.torso_height, step=0.1)
    cells = cells_around(ihcm.grid, at.shoulder, at.length)
    missing = cells[ihcm.rows_of(cells) < 0][::97]
    assert not at.solve(*ihcm.grid.tool_in_base(missing)).reached.any()


def test_manipulability_is_that_of_the_joints(ihcm, reach):
    again = reach.manipulability(ihcm.joints.astype(float))
    np.testing.assert_allclose(ihcm.manipulability, again, rtol=1e-6)


def test_cells_around_have_the_shoulder_within_the_radius(reach):
    grid = MapGrid.of(0.1, 4, "side")
    cells = cells_around(grid, reach.shoulder, 0.5)
    _, p_BT = grid.tool_in_base(cells)
    # Rounding may put a cell on the sphere itself to either side.
    assert np.linalg.norm(p_BT - reach.shoulder, axis=1).max() <= 0.5 + 1e-12
    line = np.arange(-30, 31)
    every = np.stack(np.meshgrid([0], line, line, line, np.arange(4)), -1).reshape(-1, 5)
    _, p = grid.tool_in_base(every)
    inside = np.linalg.norm(p - reach.shoulder, axis=1) <= 0.5 - 1e-12
    assert set(map(tuple, every[inside])) <= set(map(tuple, cells.tolist()))


def test_no_posture_is_longer_than_the_arm(reach, rng):
    lower, upper = reach.limits
    _, p_AT = reach.tool_poses(rng.uniform(lower, upper, (20_000, 7)))
    away = np.linalg.norm(p_AT @ reach.R_BA.T + reach.p_BA - reach.shoulder, axis=1)
    assert 0.9 * reach.length < away.max() <= reach.length


def test_a_smaller_radius_leaves_out_farther_cells(tiago):
    at = Reach(tiago, torso_height=0.15, step=0.1)
    grid = MapGrid.of(0.1, 4, "side")
    whole, near = map_from_ik(at, grid), map_from_ik(at, grid, radius=0.7)
    _, p_BT = grid.tool_in_base(whole.cells)
    inside = np.linalg.norm(p_BT - at.shoulder, axis=1) <= 0.7
    assert 0 < inside.sum() < len(inside)
    np.testing.assert_array_equal(near.cells, whole.cells[inside])


def test_threads_do_not_change_the_map(tiago):
    at = Reach(tiago, torso_height=0.15, step=0.2)
    grid = MapGrid.of(0.2, 4, "side")
    one, two = (map_from_ik(at, grid, jobs=jobs) for jobs in (1, 2))
    np.testing.assert_array_equal(one.cells, two.cells)
    np.testing.assert_array_equal(one.joints, two.joints)


def test_another_measure_is_kept_by_name(tiago):
    at = Reach(tiago, torso_height=0.15, step=0.2, measure="isotropy")
    found = map_from_ik(at, MapGrid.of(0.2, 4, "side"), map_type="ICM")
    assert found.metadata["measure"] == "isotropy"
    assert found.metadata["measure"] in MEASURES
    assert 0.0 < manipulability_scale(at) <= 1.0


def test_a_robot_without_a_head_makes_an_icm_but_no_ihcm():
    at = Reach(load_robot("iiwa7"), step=0.2)
    grid = MapGrid.of(0.2, 4, "side")
    found = map_from_ik(at, grid, map_type="ICM")
    assert len(found.cells)
    assert not found.visibility.any()
    with pytest.raises(RobotError, match="no head file"):
        map_from_ik(at, grid, map_type="IHCM")


@pytest.mark.parametrize(("torso_height", "words"), [(0.5, "out of range"), (-0.1, "out of range")])
def test_a_torso_height_out_of_range_is_refused(tiago, torso_height, words):
    with pytest.raises(GridError, match=words):
        Reach(tiago, torso_height=torso_height)


def test_invalid_arguments_are_refused_before_any_computation(tiago, monkeypatch):
    def solve(*_arguments, **_options):
        raise AssertionError

    monkeypatch.setattr(Reach, "solve", solve)
    fine = Reach(tiago, torso_height=0.15, step=0.01)
    with pytest.raises(GridError, match=r"36 heights 0\.01 m apart; a map can have at most 32"):
        map_from_ik(fine, MapGrid.of(0.01, 16, "side"))
    with pytest.raises(UnknownNameError, match="unknown visibility 'best'"):
        map_from_ik(Reach(tiago), MapGrid.of(), view_rule="best")


def test_too_many_cells_are_refused(reach):
    with pytest.raises(GridError, match="cells"):
        cells_around(MapGrid.of(0.01, 32, "all"), reach.shoulder, 0.9)
