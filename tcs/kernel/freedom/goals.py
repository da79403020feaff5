"""The freedom of the goals of a problem, and the poses that are tried."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray, IntArray
from tcs.kernel.freedom.forms import (
    AXIS,
    COLUMNS,
    FEWEST_JOINTS,
    FOLD,
    PARAMETERS,
    ROTATES,
    Poses,
    poses_of,
    spacing,
    wrist_positions,
)
from tcs.kernel.freedom.reach import WristReach, wrist_reach


class FreeGoals(NamedTuple):
    """The freedom of the goals of a problem; `first` is empty if no goal is free.

    The poses of a goal are its samples, then further ones near those: `parents` names the two
    samples next to each. Goals with the same freedom share their poses.
    """

    form: FloatArray
    """Columns as above, then the unit vectors e1 and e2, shape (goals, COLUMNS + 6)."""
    step: FloatArray
    """Spacing of the samples of each parameter [rad or m], 0 where not free, shape
    (goals, PARAMETERS)."""
    first: IntArray
    """First sample of each goal in arrays of all samples of all goals, and their number, shape
    (goals + 1,)."""
    start: IntArray
    """Row of the first pose of each goal in the arrays below, shape (goals,)."""
    parents: IntArray
    """The two samples of the goal, by their numbers, next to each pose, shape (poses, 2)."""
    child_first: IntArray
    """First of the further poses next to each pose in `children`, and their number, shape
    (poses + 1,)."""
    children: IntArray
    """Further poses of the goal, by their numbers: each twice, unless both its samples are one."""
    u: FloatArray
    """Parameters of each pose [rad and m], shape (poses, PARAMETERS)."""
    wrist: FloatArray
    """Position of the wrist at each pose, in the frame of the goal [m], shape (poses, 3)."""
    reach: WristReach
    """Where the wrist has to be."""


def no_freedom() -> FreeGoals:
    """Return the freedom of a problem in which no goal is free."""
    none = np.empty(0, np.int64)
    return FreeGoals(
        form=np.empty((0, COLUMNS + 6)),
        step=np.empty((0, PARAMETERS)),
        first=none,
        start=none,
        parents=np.empty((0, 2), np.int64),
        child_first=np.zeros(1, np.int64),
        children=none,
        u=np.empty((0, PARAMETERS)),
        wrist=np.empty((0, 3)),
        reach=WristReach(np.zeros(3), np.zeros(3), np.inf),
    )


def free_goals(rows: FloatArray, chain: Chain) -> FreeGoals:
    """Return the freedom of goals, with their sampled poses.

    Args:
        rows: The freedom of each goal, shape (goals, COLUMNS); a row of zeros for none.
        chain: The arm.
    """
    if not np.any(rows):
        return no_freedom()
    reach = wrist_reach(chain)
    forms, steps, counts, starts, wrists = [], [], [], [], []
    poses: dict[bytes, tuple[int, Poses]] = {}
    total = 0
    for row in rows:
        form = np.concatenate([row, *_basis(row)])
        if chain.joints == FEWEST_JOINTS:
            # The arm finds the angle about the axis, so that none is sampled.
            form[ROTATES], form[FOLD] = 0.0, 1.0
        key = form.tobytes()
        if key not in poses:
            poses[key] = total, poses_of(key)
            total += len(poses[key][1].u)
            wrists.append(wrist_positions(form, poses[key][1].u, reach.wrist))
        start, found = poses[key]
        forms.append(form)
        steps.append(spacing(form))
        counts.append(found.samples)
        starts.append(start)
    parts = [found for _, found in poses.values()]
    number = np.concatenate([np.diff(found.child_first) for found in parts])
    return FreeGoals(
        form=np.array(forms),
        step=np.array(steps),
        first=np.cumsum([0, *counts]),
        start=np.array(starts, np.int64),
        parents=np.concatenate([found.parents for found in parts]),
        child_first=np.cumsum([0, *number]),
        children=np.concatenate([found.children for found in parts]),
        u=np.ascontiguousarray(np.concatenate([found.u for found in parts])),
        wrist=np.ascontiguousarray(np.concatenate(wrists)),
        reach=reach,
    )


def axis_left_free(rows: FloatArray, chain: Chain) -> FloatArray:
    """Return the axis about which an arm of five joints needs its goals to be free, shape (3,).

    Args:
        rows: As for `free_goals`; all that leave the rotation about an axis free name the same one.
        chain: The arm.

    Returns:
        A unit vector in T; zeros for an arm of more joints, or without such a goal.
    """
    rotating = rows[rows[:, ROTATES] > 0.0] if len(rows) else rows
    if chain.joints != FEWEST_JOINTS or not len(rotating):
        return np.zeros(3)
    return np.array(rotating[0, AXIS : AXIS + 3], dtype=np.float64)


def _basis(row: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors perpendicular to the axis and to each other."""
    axis = row[AXIS : AXIS + 3]
    if not np.any(axis):
        return np.zeros(3), np.zeros(3)
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first = first / np.linalg.norm(first)
    return first, np.cross(axis, first)
