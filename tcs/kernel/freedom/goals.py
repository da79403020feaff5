"""What is free about the poses of a problem's goals, and the poses that are tried."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, Chain, FloatArray, IntArray
from tcs.kernel.dexterity import ANY, INVERSE_CONDITION, ISOTROPY, UNLIMITED, Dexterity, dexterity
from tcs.kernel.freedom.forms import (
    ANGLES,
    AXIS,
    COLUMNS,
    FEW,
    FEWEST_JOINTS,
    FOLD,
    FULL_TURN,
    HALF,
    PARAMETERS,
    ROTATES,
    TILT,
    TURNS,
    Poses,
    coarse_tilts,
    poses_of,
    spacing,
    wrist_positions,
)
from tcs.kernel.freedom.reach import WristReach, no_reach, wrist_reach

ON_AXIS = 1e-9
"""Greatest distance of the tool from the axis of the last joint [m], and sine of the angle between
that axis and the one about which a goal is free: both are exact but for rounding."""
WIDEST = np.nextafter(np.pi, 0.0)
"""Tilt of the widest cone [rad]."""


class FreeGoals(NamedTuple):
    """What is free about the poses of the goals of a problem; `first` is empty if nothing is.

    Tool poses are tried in the order of lists: that of each pose, and, where any orientation
    serves, that of the widest cone where the first one reaches nothing, so that no cone reaches
    more. A list begins with samples; further poses near those follow: `parents` names the two
    samples next to each. Poses with the same freedom share their list.
    """

    form: FloatArray
    """Columns as above, then the unit vectors e1 and e2, shape (poses, COLUMNS + 6)."""
    turned: BoolArray
    """Whether the last joint turns the tool about the axis, of whose angle the list says nothing:
    the arm finds it, shape (poses,)."""
    step: FloatArray
    """Spacing of the samples of each parameter [rad or m], 0 where not free, shape
    (poses, PARAMETERS)."""
    fallback: IntArray
    """Number of the list of the widest cone, -1 without, shape (poses,). The first lists are those
    of the poses."""
    first: IntArray
    """First sample of each list among those of all lists, and their number, shape (lists + 1,)."""
    codes: IntArray
    """First of the gripper's contact codes of each list, and their number, shape (lists + 1,)."""
    start: IntArray
    """Row of the first tool pose of each list in the arrays below, shape (lists,)."""
    parents: IntArray
    """The two samples of the list, by their numbers, next to each tool pose, shape (n, 2)."""
    child_first: IntArray
    """First of the further tool poses next to each in `children`, and their number, shape
    (n + 1,)."""
    children: IntArray
    """Further tool poses of the list, by their numbers: each twice, unless both its samples are
    one."""
    u: FloatArray
    """Parameters of each tool pose [rad and m], shape (n, PARAMETERS)."""
    wrist: FloatArray
    """Position of the wrist at each tool pose, in the frame of the goal [m], shape (n, 3)."""
    is_tried: BoolArray
    """Whether a tool pose is tried although another one reaches the goal: the nominal one, at each
    angle about the axis, some tilts near the rim of a cone, and those of any orientation. From the
    best of these the others are within a climb, shape (n,)."""
    around: FloatArray
    """Centre and radius of a sphere with the wrist at every pose of the freedom, in the frame of
    the goal [m], shape (poses, 4)."""
    reach: WristReach
    """Where the wrist has to be."""

    def samples(self, pose: int) -> FloatArray:
        """Return the parameters of the samples of a pose, with the angles that the arm finds."""
        start = self.start[pose]
        u = self.u[start : start + self.first[pose + 1] - self.first[pose]]
        if not self.turned[pose]:
            return u
        turns = TURNS[: ANGLES if len(u) == 1 else FEW, None] * np.eye(PARAMETERS)[0]
        return (u[:, None] + turns).reshape(-1, PARAMETERS)


def no_freedom() -> FreeGoals:
    """Return the freedom of a problem in which nothing is free."""
    none = np.empty(0, np.int64)
    return FreeGoals(
        form=np.empty((0, COLUMNS + 6)),
        turned=np.empty(0, np.bool_),
        step=np.empty((0, PARAMETERS)),
        fallback=none,
        first=none,
        codes=none,
        start=none,
        parents=np.empty((0, 2), np.int64),
        child_first=np.zeros(1, np.int64),
        children=none,
        u=np.empty((0, PARAMETERS)),
        wrist=np.empty((0, 3)),
        is_tried=np.empty(0, np.bool_),
        around=np.empty((0, 4)),
        reach=no_reach(),
    )


def free_turn(axis: FloatArray, count: int, reach: WristReach) -> FreeGoals:
    """Return the freedom of single poses at which an arm of five joints finds the angle.

    Args:
        axis: Axis in T about which the tool may rotate, shape (3,).
        count: Number of poses.
        reach: Where the wrist has to be.
    """
    form = np.zeros((count, COLUMNS + 6))
    form[:, AXIS : AXIS + 3], form[:, FOLD] = axis, 1.0
    return no_freedom()._replace(
        form=form,
        turned=np.zeros(count, np.bool_),
        step=np.zeros((count, PARAMETERS)),
        fallback=np.full(count, -1),
        first=np.arange(count + 1),
        codes=np.arange(count + 1),
        start=np.zeros(count, np.int64),
        parents=np.zeros((1, 2), np.int64),
        child_first=np.zeros(2, np.int64),
        u=np.zeros((1, PARAMETERS)),
        wrist=np.zeros((1, 3)),
        is_tried=np.ones(1, np.bool_),
        around=np.zeros((count, 4)),
        reach=reach,
    )


def free_goals(rows: FloatArray, chain: Chain, measure: Dexterity | None = None) -> FreeGoals:
    """Return the freedom of the poses of goals, with the tool poses to try.

    Args:
        rows: The freedom of each pose, shape (poses, COLUMNS); a row of zeros for none.
        chain: The arm.
        measure: The measure to maximise; None for the usual one.
    """
    if not np.any(rows):
        return no_freedom()
    reach, last = wrist_reach(chain), _last_axis(chain, measure or dexterity("isotropy"))
    lists: list[tuple[FloatArray, Poses, int]] = []
    poses: dict[bytes, tuple[int, Poses]] = {}
    wrists: list[FloatArray] = []
    tried: list[BoolArray] = []

    def add(form: FloatArray, turned: bool, *, is_first: bool) -> None:
        key = form.tobytes()
        if key not in poses:
            poses[key] = sum(len(found.u) for _, found in poses.values()), poses_of(key)
            u = poses[key][1].u
            wrists.append(wrist_positions(form, u, reach.wrist))
            is_angle = ~np.any(u[:, 1:], axis=1)
            tried.append((form[TILT] >= np.pi) | is_angle | coarse_tilts(form, u))
        found = poses[key][1]
        codes = found.samples
        if turned:
            codes = len(TURNS) + FEW * (codes - 1)
        lists.append((form, found, codes if is_first else 0))

    forms, turned, fallbacks = [], [], []
    for row in rows:
        is_turned = bool(row[ROTATES]) and _is_about(row, last)
        if is_turned and row[TILT] >= np.pi:
            row = np.concatenate([last, row[AXIS + 3 :]])
        form = np.concatenate([row, *_basis(row)])
        if chain.joints == FEWEST_JOINTS:
            form = _without_angle(form)
        forms.append(form)
        turned.append(is_turned)
        add(_without_angle(form) if is_turned else form, is_turned, is_first=True)
    for form, is_turned in zip(forms, turned, strict=True):
        fallbacks.append(-1)
        if form[TILT] >= np.pi:
            fallbacks[-1] = len(lists)
            cone = form.copy()
            cone[TILT] = WIDEST
            add(_without_angle(cone) if is_turned else cone, is_turned, is_first=False)
    parts = [found for _, found in poses.values()]
    number = np.concatenate([np.diff(found.child_first) for found in parts])
    return FreeGoals(
        form=np.array(forms),
        turned=np.array(turned),
        step=np.array([spacing(form) for form, _, _ in lists[: len(rows)]]),
        fallback=np.array(fallbacks, np.int64),
        first=np.cumsum([0, *(found.samples for _, found, _ in lists)]),
        codes=np.cumsum([0, *(codes for _, _, codes in lists)]),
        start=np.array([poses[form.tobytes()][0] for form, _, _ in lists], np.int64),
        parents=np.concatenate([found.parents for found in parts]),
        child_first=np.cumsum([0, *number]),
        children=np.concatenate([found.children for found in parts]),
        u=np.ascontiguousarray(np.concatenate([found.u for found in parts])),
        wrist=np.ascontiguousarray(np.concatenate(wrists)),
        is_tried=np.concatenate(tried),
        around=np.array([_around(form, reach.wrist) for form in forms]),
        reach=reach,
    )


def _around(form: FloatArray, wrist: FloatArray) -> FloatArray:
    """Return a sphere with the wrist at every pose of a freedom: its centre and radius, shape (4,).

    A tilted axis, and the wrist about it, stays in a cone: the sphere has the rims of the spherical
    caps of both its ends along the axis.
    """
    half = float(np.linalg.norm(form[HALF : HALF + 3]))
    axis, tilt = form[AXIS : AXIS + 3], float(form[TILT])
    along, length = float(wrist @ axis), float(np.linalg.norm(wrist))
    if tilt >= 0.5 * np.pi:
        return np.array([0.0, 0.0, 0.0, length + half])
    turns = bool(form[ROTATES]) or form[FOLD] > 1.0
    centre = along * np.cos(tilt) * axis if turns else np.cos(tilt) * wrist
    across = float(np.linalg.norm(wrist - along * axis))
    if turns:
        # The farthest of the wrist's poses: on the axis by `along`, then beside it.
        radius = abs(along) * np.sin(tilt) + across
        return np.append(centre, radius + half)
    # A tilt moves a point of distance `length` from the goal by an angle of up to the tilt.
    return np.append(centre, length * np.sin(tilt) + half)


def _without_angle(form: FloatArray) -> FloatArray:
    """Return a freedom of whose angle about the axis no samples are needed: the arm finds it."""
    form = form.copy()
    form[ROTATES], form[FOLD] = 0.0, 1.0
    return form


def _last_axis(chain: Chain, measure: Dexterity) -> FloatArray:
    """Return the axis about which the last joint turns the tool on the spot, shape (3,).

    All angles are then alike for the other joints, and for the measure: one solution decides.

    Returns:
        A unit vector in T; zeros if the tool is beside the axis of the last joint, the joint is
        prismatic, or the measure depends on its angle.
    """
    beside = float(np.hypot(*chain.p[7][:2]))
    is_limited = chain.upper[6] - chain.lower[6] < FULL_TURN
    of, penalty = measure
    is_alike = of in (ISOTROPY, INVERSE_CONDITION, ANY) and penalty == UNLIMITED
    known = chain.joints > FEWEST_JOINTS and chain.slides[6] == 0.0
    if not known or beside > ON_AXIS or (is_limited and not is_alike):
        return np.zeros(3)
    return np.asarray(chain.R[7][2], dtype=np.float64).copy()


def _is_about(row: FloatArray, axis: FloatArray) -> bool:
    """Return whether a freedom leaves the rotation about an axis free, zeros for none."""
    if not np.any(axis):
        return False
    apart = float(np.linalg.norm(np.cross(row[AXIS : AXIS + 3], axis)))
    return bool(row[TILT] >= np.pi) or apart < ON_AXIS


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
