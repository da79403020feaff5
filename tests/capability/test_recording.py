import numpy as np
import pytest

from tcs.capability import MapGrid, map_from_recording, read_csv, recording_of, write_csv
from tcs.errors import DataFileError

# As a real TIAGo publishes them, ITCM thesis, Listing 1; the arm's first seven, a head, the torso.
NAMES = [*(f"arm_{i}_joint" for i in range(1, 8)), "head_1_joint", "torso_lift_joint"]
LISTING = [
    1.0058956265627637, -0.6668913466995965, -1.354832333675927, 0.7812407815765756,
    -0.6853028725871546, 0.591213316532442, 1.7869163059953614, -0.010122909649999998,
    0.34834603143986886,
]  # fmt: skip


def test_the_sample_of_the_thesis_is_accepted(tiago):
    found = recording_of(NAMES, [LISTING], tiago)
    np.testing.assert_array_equal(found.joints, [LISTING[:7]])
    assert found.torso_height.tolist() == [LISTING[8]]


def test_names_come_in_any_order(tiago, rng):
    order = rng.permutation(len(NAMES))
    found = recording_of([NAMES[i] for i in order], [[LISTING[i] for i in order]], tiago)
    np.testing.assert_array_equal(found.joints, [LISTING[:7]])
    assert found.torso_height.tolist() == [LISTING[8]]


def test_without_a_torso_the_torso_height_is_unknown(tiago):
    assert recording_of(NAMES[:7], [LISTING[:7]], tiago).torso_height is None


@pytest.mark.parametrize(
    ("names", "positions", "message"),
    [
        (NAMES[1:], [LISTING[1:]], "joint names do not match robot 'tiago': arm_1_joint missing"),
        (["a"], [[1.0]], "arm_1_joint, .*arm_7_joint missing. It has: a"),
        ([*NAMES, "arm_1_joint"], [[*LISTING, 0.1]], "'arm_1_joint' occurs twice"),
        (NAMES, [LISTING[:5]], "shape"),
        (NAMES, [LISTING, [np.nan, *LISTING[1:]]], "sample 1, joint 'arm_1_joint' is nan"),
        (NAMES, [[np.inf, *LISTING[1:]]], "sample 0, joint 'arm_1_joint' is inf"),
        (NAMES, [[57.6, *LISTING[1:]]], "outside its soft limits 0.0700 to 2.6789.*radians"),
        (NAMES, np.empty((0, len(NAMES))), "no valid sample"),
    ],
)
def test_invalid_samples_are_refused(tiago, names, positions, message):
    with pytest.raises(DataFileError, match=message):
        recording_of(names, positions, tiago)


def test_bad_samples_can_be_dropped(tiago):
    bad = [np.nan, *LISTING[1:]]
    found = recording_of(NAMES, [LISTING, bad, LISTING], tiago, drop_bad=True)
    assert (len(found), found.dropped) == (2, 1)
    with pytest.raises(DataFileError, match="no valid sample"):
        recording_of(NAMES, [bad], tiago, drop_bad=True)


def test_an_encoder_value_just_beyond_a_limit_is_clipped(tiago):
    upper = tiago.joint_limits()["arm_1_joint"][1]
    found = recording_of(NAMES, [[upper + 1e-3, *LISTING[1:]]], tiago)
    assert found.joints[0, 0] == upper


def test_a_csv_round_trip(tiago, tmp_path):
    path = tmp_path / "arm.csv"
    write_csv(path, tiago, recording_of(NAMES, [LISTING] * 3, tiago))
    back = read_csv(path, tiago)
    # Eight decimals are written.
    np.testing.assert_allclose(back.joints, [LISTING[:7]] * 3, atol=1e-8)
    np.testing.assert_allclose(back.torso_height, [LISTING[8]] * 3, atol=1e-8)


def test_columns_other_than_joints_are_ignored(tiago, tmp_path):
    path = tmp_path / "arm.csv"
    numbers = ",".join(map(str, LISTING))
    path.write_text(f"time,mode,{','.join(NAMES)}\n0.0,teleop,{numbers}\n")
    np.testing.assert_array_equal(read_csv(path, tiago).joints, [LISTING[:7]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        ("time,x\n1,2\n", "do not match"),
        (",".join(NAMES) + "\n1,2\n", "line 2: must be 9 numbers"),
        (",".join(NAMES) + "\n" + ",".join(["one"] * 9) + "\n", "line 2: must be 9 numbers"),
        (",".join(NAMES) + "\n", "no valid sample"),
    ],
)
def test_invalid_csv_files(tiago, tmp_path, text, message):
    path = tmp_path / "arm.csv"
    path.write_text(text)
    with pytest.raises(DataFileError, match=message):
        read_csv(path, tiago)


def test_a_missing_csv(tiago, tmp_path):
    with pytest.raises(DataFileError, match="cannot be read"):
        read_csv(tmp_path / "none.csv", tiago)


def postures_of(ihcm, tiago, rows, torso_height):
    joints = np.column_stack([ihcm.joints[rows], np.full(len(rows), torso_height)]).astype(float)
    return recording_of([*tiago.arm_joints, tiago.torso_joint], joints, tiago)


def test_the_postures_of_a_map_give_the_same_map(ihcm, reach, tiago, rng):
    rows = np.sort(rng.choice(len(ihcm.cells), 200, replace=False))
    found = map_from_recording(reach, ihcm.grid, postures_of(ihcm, tiago, rows, reach.torso_height))
    np.testing.assert_array_equal(found.capability.cells, ihcm.cells[rows])
    np.testing.assert_allclose(
        found.capability.manipulability, ihcm.manipulability[rows], rtol=1e-5
    )
    np.testing.assert_allclose(found.capability.visibility, ihcm.visibility[rows], atol=1e-6)
    # Single precision in the joints.
    assert found.offsets.max() < 1e-5


def test_the_torso_height_of_the_recording_does_not_move_the_map(ihcm, reach, tiago, rng):
    rows = np.sort(rng.choice(len(ihcm.cells), 50, replace=False))
    low, high = (
        map_from_recording(
            reach, ihcm.grid, postures_of(ihcm, tiago, rows, torso_height)
        ).capability
        for torso_height in (0.0, 0.3)
    )
    np.testing.assert_array_equal(low.cells, high.cells)


def test_the_height_is_measured_above_the_floor(ihcm, reach, tiago):
    raised = 0.1
    heights = ihcm.grid.tool_in_base(ihcm.cells)[1][:, 2]
    rows = np.flatnonzero(np.abs(heights - heights[0]) < 1e-6)[:50]
    recorded = postures_of(ihcm, tiago, rows, reach.torso_height + raised)
    at = float(heights[0]) + raised
    found = map_from_recording(reach, ihcm.grid, recorded, height=at, height_margin=0.01)
    assert (len(found.capability.cells), found.wrong_height) == (len(rows), 0)
    with pytest.raises(DataFileError, match="none of the 50 samples"):
        map_from_recording(reach, ihcm.grid, recorded, height=at + 0.02, height_margin=0.01)


def test_the_sample_of_a_cell_is_the_nearest(ihcm, reach, tiago):
    """By the product of both distances, each scaled linearly over all samples: Appendix C.2.3."""
    rng = np.random.default_rng(3)
    row = int(np.argmax(ihcm.manipulability))
    near = ihcm.joints[row] + rng.normal(0.0, 0.02, (40, 7))
    limits = np.array([tiago.joint_limits()[name] for name in tiago.arm_joints])
    recorded = recording_of(tiago.arm_joints, np.clip(near, *limits.T), tiago)
    grid = ihcm.grid
    found = map_from_recording(reach, grid, recorded)
    R, p = reach.tool_poses(recorded.joints)
    cells = grid.nearest(reach.R_BA @ R, p @ reach.R_BA.T + reach.p_BA)
    apart, turned = np.linalg.norm(cells.offset, axis=1), cells.angle
    apart, turned = ((d - d.min()) / (d.max() - d.min()) for d in (apart, turned))
    for cell, joints in zip(found.capability.cells, found.capability.joints, strict=True):
        same = np.flatnonzero((cells.cells == cell).all(axis=1))
        best = same[np.argmin((apart * turned)[same])]
        np.testing.assert_array_equal(joints, recorded.joints[best].astype(np.float32))
    assert len(found.capability.cells) < len(recorded)


def test_a_posture_tilted_by_more_than_half_a_cell_is_left_out(ihcm, reach, tiago):
    tops = np.flatnonzero(ihcm.cells[:, 0] == 1)[:20]
    recorded = postures_of(ihcm, tiago, tops, reach.torso_height)
    with pytest.raises(DataFileError, match="grasps"):
        map_from_recording(reach, MapGrid.of(0.1, 8, "side"), recorded)


def test_the_error_table_is_half_a_cell_at_most(ihcm, reach, tiago, rng):
    rows = rng.choice(len(ihcm.cells), 300, replace=False)
    grid = MapGrid.of(0.07, 16, "side+top")
    found = map_from_recording(reach, grid, postures_of(ihcm, tiago, rows, reach.torso_height))
    assert set(found.error_table()) == {"x", "y", "z", "roll", "pitch", "yaw"}
    assert found.offsets[:, :3].max() <= 0.035 + 1e-9
    assert found.offsets[:, 3:].max() <= 0.5 * grid.yaw_step + 1e-9
    assert found.offsets[:, 0].mean() > 0.0
