"""Runs and their files: round trips, capability maps of runs, and invalid files."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tcs.capability import read_csv
from tcs.errors import DataFileError, OutputError
from tcs.model.robots import load_robot
from tcs.teleop.runs.run import NO_GROUP, Run
from tcs.teleop.runs.run_files import load_run, save_run

ROBOT = load_robot("tiago")
ARRAYS = [
    "time", "joints", "rates", "position", "quaternion", "linear", "angular", "group", "sign",
    "clutch", "mode", "limits", "singular", "stopped",
]  # fmt: skip


def made(n=40, seed=0, **changes):
    rng = np.random.default_rng(seed)
    limits = np.array([ROBOT.joint_limits()[name] for name in ROBOT.arm_joints])
    quaternion = rng.standard_normal((n, 4))
    arrays = {
        "time": np.arange(n) * 0.01,
        "joints": rng.uniform(limits[:, 0], limits[:, 1], size=(n, 7)),
        "rates": rng.standard_normal((n, 7)),
        "position": rng.standard_normal((n, 3)),
        "quaternion": quaternion / np.linalg.norm(quaternion, axis=1)[:, None],
        "linear": rng.standard_normal((n, 3)),
        "angular": rng.standard_normal((n, 3)),
        "group": rng.integers(NO_GROUP, 4, n),
        "sign": rng.integers(-1, 2, n),
        "clutch": rng.random(n) < 0.5,
        "mode": np.where(rng.random(n) < 0.5, "pose", "end-effector"),
        "limits": rng.integers(-1, 2, (n, 7)),
        "singular": rng.random(n) < 0.5,
        "stopped": rng.random(n) < 0.5,
    }
    return Run(ROBOT.arm_joints, **{**arrays, **changes}, metadata={"robot": "tiago", "seed": seed})


def test_run_file_round_trip(tmp_path):
    run, path = made(), tmp_path / "run.csv"
    save_run(path, run)
    back = load_run(path)
    assert back.joint_names == run.joint_names
    assert back.metadata == run.metadata
    for name in ARRAYS:
        found, saved = getattr(back, name), getattr(run, name)
        assert found.dtype.kind == saved.dtype.kind
        if found.dtype.kind == "f":
            np.testing.assert_allclose(found, saved, rtol=1e-9, atol=1e-9)
        else:
            np.testing.assert_array_equal(found, saved)


def test_a_capability_map_reads_a_saved_run_as_it_is(tmp_path):
    run = made()
    save_run(tmp_path / "run.csv", run)
    recording = read_csv(tmp_path / "run.csv", ROBOT)
    np.testing.assert_allclose(recording.joints, run.joints, atol=1e-9)
    assert recording.torso_height is None


def test_nothing_is_left_where_a_run_cannot_be_written(tmp_path):
    with pytest.raises(OutputError, match="cannot be written"):
        save_run(tmp_path / "nowhere" / "run.csv", made())
    with pytest.raises(OutputError, match=r"a run is \.csv"):
        save_run(tmp_path / "run.xlsx", made())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rates": np.zeros((40, 6))}, "'rates' has shape"),
        ({"time": np.zeros(40)}, "sample 1: 'time' must rise"),
        ({"time": np.arange(40) * 1e6}, r"sample 11: 'time' must be within 1e\+07 s"),
        ({"position": np.full((40, 3), 1e9)}, "sample 0: 'position' must be within 1000 m"),
        ({"group": np.full(40, -2)}, r"sample 0: 'group' must be -1 \(none\) to 99"),
        ({"sign": np.full(40, 7)}, "sample 0: 'sign' must be -1, 0 or 1"),
        ({"limits": np.full((40, 7), 9)}, "sample 0: 'limits' must be -1, 0 or 1"),
        ({"position": np.full((40, 3), np.nan)}, "sample 0: 'position' is not finite"),
        ({"quaternion": np.ones((40, 4))}, "sample 0: 'quaternion' must have length 1"),
        ({"quaternion": np.full((40, 4), 1e300)}, "sample 0: 'quaternion' must have length 1"),
        ({"mode": np.full(40, "xyz")}, "sample 0: 'mode' must be one of end-effector, null-"),
        ({"joints": np.full((40, 7), 1e9)}, "sample 0: 'joints' must be within 1000 rad"),
    ],
)
def test_arrays_that_do_not_belong_together_are_refused(changes, said):
    with pytest.raises(DataFileError, match=said):
        made(**changes)


def test_files_without_a_run_are_refused(tmp_path):
    with pytest.raises(DataFileError, match="cannot be read: No such file"):
        load_run(tmp_path / "none.csv")
    with pytest.raises(DataFileError, match=r"must be \.csv"):
        load_run(tmp_path / "run.txt")
    (tmp_path / "empty.csv").write_text("")
    with pytest.raises(DataFileError, match="is not a table"):
        load_run(tmp_path / "empty.csv")
    save_run(tmp_path / "run.csv", made())
    frame = pd.read_csv(tmp_path / "run.csv", keep_default_na=False)
    frame.drop(columns="qw").to_csv(tmp_path / "less.csv", index=False)
    with pytest.raises(DataFileError, match="column qw is missing"):
        load_run(tmp_path / "less.csv")
    frame.astype({"x": object}).assign(x="here").to_csv(tmp_path / "words.csv", index=False)
    with pytest.raises(DataFileError, match="sample 0: 'x' is 'here'; must be a number"):
        load_run(tmp_path / "words.csv")
    frame.assign(metadata="{").to_csv(tmp_path / "metadata.csv", index=False)
    with pytest.raises(DataFileError, match="not a JSON object"):
        load_run(tmp_path / "metadata.csv")


@pytest.mark.parametrize("count", [1, 20, 200])
def test_a_last_row_that_is_cut_short_is_refused_with_its_number(tmp_path, count):
    path = tmp_path / "run.csv"
    save_run(path, made())
    path.write_bytes(path.read_bytes()[: -count - 1])
    with pytest.raises(DataFileError, match=r"run\.csv', sample 39: the row is cut short\. Delete"):
        load_run(path)


def test_a_cut_file_is_a_shorter_run_or_refused_in_one_line(tmp_path):
    whole, path = tmp_path / "run.csv", tmp_path / "cut.csv"
    save_run(whole, made(4))
    content, messages = whole.read_bytes(), []
    for length in range(0, len(content), 7):
        path.write_bytes(content[:length])
        try:
            assert len(load_run(path)) < 4
        except DataFileError as error:
            messages.append(str(error))
    assert len(messages) > 100
    for message in messages:
        assert message.startswith(f"run '{path}'")
        assert "\n" not in message
        assert ": run" not in message


@pytest.mark.parametrize(
    ("column", "value", "expected"),
    [
        ("group", "1.5", "'group' is '1.5'; must be an integer"),
        ("group", "1e300", r"'group' is '1e\+300'; must be an integer"),
        ("group", "-9", "'group' must be -1"),
        ("sign", "", "'sign' is ''; must be an integer"),
        ("clutch", "2", "'clutch' is '2'; must be 0 or 1"),
        ("stopped", "yes", "'stopped' is 'yes'; must be 0 or 1"),
        ("time", "inf", "'time' is not finite"),
        ("time", "nan", "'time' is 'nan'; must be a number"),
        ("x", "1e300", "'position' must be within 1000 m"),
        ("mode", "", "'mode' must be one of"),
        ("metadata", "[" * 100000, "'metadata' of the first sample is not a JSON"),
        ("metadata", "3", "'metadata' of the first sample is not a JSON"),
        ("metadata", '{"robot": "tiago"}', "it has format 1; this version of tcs reads format 2"),
    ],
)
def test_odd_values_are_refused_with_their_sample(tmp_path, column, value, expected):
    path = tmp_path / "run.csv"
    save_run(path, made())
    frame = pd.read_csv(path, keep_default_na=False, dtype=str)
    frame.loc[0, column] = value
    frame.to_csv(path, index=False)
    with pytest.raises(DataFileError, match=r"run\.csv'(, sample 0)?: " + expected):
        load_run(path)


def test_arrays_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        made().joints[0, 0] = 1.0


def test_the_hand_follows_the_commands_while_it_is_coupled():
    n = 201
    steady = {"linear": np.tile([0.1, 0.0, -0.2], (n, 1)), "angular": np.tile([0.3, 0, 0], (n, 1))}
    time, none, never = np.arange(n) * 0.01, np.full(n, NO_GROUP), np.zeros(n, dtype=bool)
    position, angles = made(n, time=time, group=none, clutch=never, **steady).hand()
    np.testing.assert_allclose(position[-1], [0.2, 0.0, -0.4], atol=1e-12)
    np.testing.assert_allclose(angles[-1], [0.6, 0.0, 0.0], atol=1e-12)
    half = np.arange(n) > 100
    position, angles = made(n, time=time, group=none, clutch=half, **steady).hand()
    np.testing.assert_allclose(position[-1], [0.1, 0.0, -0.2], atol=1e-12)
    np.testing.assert_allclose(angles[-1], [0.3, 0.0, 0.0], atol=1e-12)
    position, angles = made(n, time=time, group=np.zeros(n, int), clutch=never, **steady).hand()
    assert not position.any()
    assert not angles.any()
