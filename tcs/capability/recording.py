"""Recorded arm configurations: joint states matched to the arm by name, and validated."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.errors import DataFileError
from tcs.files.quantities import JOINT_LIMIT
from tcs.files.reading import read_text
from tcs.files.writing import whole_file
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.model.robots import RobotFile

MAX_BYTES = 1024**3
"""Most bytes of a recording: a day at 100 samples a second."""

LIMIT_SLACK = 2e-3
"""Tolerance of joint limits [rad or m]: a few times the resolution of a coarse encoder."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Joint states in the order of the joints of the arm."""

    joints: FloatArray
    """Arm joints [rad], within the limits in force, shape (n, 7)."""
    torso_height: FloatArray | None
    """Torso height [m], shape (n,); None if it was not recorded."""
    dropped: int = 0
    """Number of invalid samples that were left out."""

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for array in (self.joints, self.torso_height):
            if array is not None:
                array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.joints)


def recording_of(
    names: Sequence[str],
    positions: ArrayLike,
    robot: RobotFile,
    *,
    where: str = "recording",
    drop_bad: bool = False,
) -> Recording:
    """Return valid joint states in the order of the joints of an arm.

    Args:
        names: Names of the columns, in any order; joints other than those of arm and torso are
            ignored.
        positions: Joint positions [rad or m], shape (samples, names).
        robot: The robot.
        where: Name of the recording in messages.
        drop_bad: Leave out samples that are not finite or beyond the limits, instead of raising.

    Raises:
        DataFileError: If a joint of the arm is missing or occurs twice, or a sample is invalid.
    """
    array = np.asarray(positions, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != len(names):
        raise DataFileError(
            f"{where}: positions have shape {array.shape}, but there are {len(names)} names."
        )
    check_names(names, robot, where)
    wanted = list(robot.arm_joints)
    torso = robot.torso_joint
    if torso is not None and torso in names:
        wanted.append(torso)
    column = list(names)
    values = array[:, [column.index(name) for name in wanted]]
    bad = _first_bad(values, wanted, robot, where, drop_bad)
    kept = values[~bad]
    if not len(kept):
        raise DataFileError(f"{where} has no valid sample.")
    limits = np.array([robot.joint_limits()[name] for name in wanted])
    kept = np.clip(kept, limits[:, 0], limits[:, 1])
    arm = len(robot.arm_joints)
    torso_height = kept[:, arm].copy() if len(wanted) > arm else None
    return Recording(kept[:, :arm].copy(), torso_height, int(bad.sum()))


def check_names(names: Sequence[str], robot: RobotFile, where: str) -> None:
    """Check that each joint of the arm occurs once.

    Raises:
        DataFileError: If a joint is missing or occurs twice.
    """
    missing = [name for name in robot.arm_joints if name not in names]
    if missing:
        found = ", ".join(names[:20]) or "none"
        raise DataFileError(
            f"{where}: joint names do not match robot '{robot.name}': {', '.join(missing)} "
            f"missing. It has: {found}."
        )
    for name in robot.arm_joints:
        if list(names).count(name) > 1:
            raise DataFileError(f"{where}: joint '{name}' occurs twice.")


def _first_bad(
    values: FloatArray, names: Sequence[str], robot: RobotFile, where: str, drop_bad: bool
) -> BoolArray:
    """Return which samples are invalid; raise for the first one unless they may be dropped."""
    limits = robot.joint_limits()
    low, high = (np.array([limits[name][side] for name in names]) for side in (0, 1))
    # A continuous joint has no limits, but its angle has a range.
    low, high = np.maximum(low, JOINT_LIMIT.low), np.minimum(high, JOINT_LIMIT.high)
    finite = np.isfinite(values)
    inside = (values >= low - LIMIT_SLACK) & (values <= high + LIMIT_SLACK)
    bad: BoolArray = np.asarray(~(finite & inside).all(axis=1))
    if drop_bad or not bad.any():
        return bad
    i = int(np.argmax(bad))
    j = int(np.argmax(~(finite[i] & inside[i])))
    others = f" {int(bad.sum()) - 1} more samples are invalid." if bad.sum() > 1 else ""
    location = f"{where}, sample {i}, joint '{names[j]}'"
    if not finite[i, j]:
        raise DataFileError(f"{location} is {values[i, j]}.{others} Drop them with --drop-bad.")
    raise DataFileError(
        f"{location} is {values[i, j]:.4f}, outside its {robot.limits} limits {low[j]:.4f} to "
        f"{high[j]:.4f}.{others} Angles must be radians; drop such samples with --drop-bad."
    )


def read_csv(path: Path, robot: RobotFile, *, drop_bad: bool = False) -> Recording:
    """Return the recording in a CSV file: a row of names, then a row per sample.

    Args:
        path: The file; columns other than joints of arm and torso, such as time, are ignored.
        robot: The robot.
        drop_bad: As in `recording_of`.

    Raises:
        DataFileError: If the file cannot be read, or is not a recording of the robot.
    """
    where = f"recording '{path}'"
    text = read_text(path, where, DataFileError, limit=MAX_BYTES)
    try:
        rows = [row for row in csv.reader(io.StringIO(text, newline="")) if row]
    except csv.Error as error:
        raise DataFileError(f"{where} is not a CSV file: {error}.") from None
    if not rows:
        raise DataFileError(f"{where} is empty; its first row must name the joints.")
    names = [name.strip() for name in rows[0]]
    check_names(names, robot, where)
    joints = {*robot.arm_joints, robot.torso_joint}
    columns = [i for i, name in enumerate(names) if name in joints]
    numbers = np.empty((len(rows) - 1, len(columns)))
    for i, row in enumerate(rows[1:]):
        try:
            if len(row) != len(names):
                raise ValueError
            numbers[i] = [float(row[column]) for column in columns]
        except ValueError:
            raise DataFileError(
                f"{where}, line {i + 2}: must be {len(names)} numbers, one for each name."
            ) from None
    chosen = [names[column] for column in columns]
    return recording_of(chosen, numbers, robot, where=where, drop_bad=drop_bad)


def write_csv(path: Path, robot: RobotFile, recording: Recording) -> None:
    """Write a recording to a CSV file, which `read_csv` reads.

    Raises:
        OutputError: If the file cannot be written.
    """
    names, columns = list(robot.arm_joints), [recording.joints]
    if recording.torso_height is not None and robot.torso_joint is not None:
        names.append(robot.torso_joint)
        columns.append(recording.torso_height[:, None])
    table: NDArray[np.float64] = np.hstack(columns)
    with whole_file(path, "Recording") as stream:
        # 1e-8 rad is far below the resolution of an encoder.
        header = ",".join(names)
        np.savetxt(stream, table, fmt="%.8f", delimiter=",", header=header, comments="")
