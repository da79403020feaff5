"""Freedom of each goal as numbers, and the tool poses sampled from it.

A pose of the freedom has six parameters u: the rotation angle about the axis, the two components of
the tilt (a rotation vector perpendicular to the axis), and the displacement,
R_GT = exp(u1 e1 + u2 e2) Rot(axis, u0), p_GT = (u3, u4, u5), where e1, e2 and the axis are
perpendicular. Parameters that are not free are zero.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.low_discrepancy import spread

AXIS, ROTATES, FOLD, TILT, HALF = 0, 3, 4, 5, 6
"""Columns of a freedom: unit axis, whether the angle about it is free, number of equivalent angles,
greatest tilt [rad], greatest displacements [m]."""
COLUMNS = 9
PARAMETERS = 6
ANGLES = 24
"""Samples of a free angle about an axis: one every 15 degrees."""
MIXED = 2
"""Every second angle is tried with tilts and displacements too."""
TILTS = np.radians([2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0, 90.0, 135.0, 180.0])
"""Tilts of the samples [rad]."""
AROUND = (4, 6, 8, 12, 16, 16, 16, 16, 16, 12, 1)
"""Number of their directions."""
DISPLACEMENTS = np.array([0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5])
"""Displacements of the samples along an axis of the goal [m]."""
AT_ANGLE = 3
"""One tilt in so many is sampled at an angle about the axis other than 0 and 180 degrees."""
AT_ROTATION = (0, 4, 16, 32)
"""One displacement in so many is sampled at a rotation, by the number of axes it is along."""
AT_BOTH = 8
"""Factor of these numbers at a tilt and an angle about the axis at once."""
ORIENTATIONS = 288
"""Number of samples of a tool that may have any orientation: its angles range over full turns."""
DIRECTIONS = 96
"""Number of them for an arm that finds the angle about the axis."""
SUBDIVISIONS = 4
"""Parts into which the spacing of the samples is divided where none of them reaches a goal."""
WIDEST_STEP = np.radians(40.0)
"""Greatest step of a tilt from which the best pose is refined [rad]."""
WITHIN = 1e-9
"""Rounding of a bound [rad or m]."""
FURTHER = 20
"""Further poses for each sample of a tool that may have any orientation."""
FULL_TURN = 2.0 * np.pi
FEW = 8
"""Angles that the last joint makes, where it turns the tool about the axis, at a pose that is
tilted or displaced; at the nominal one, ANGLES * SUBDIVISIONS."""
FEWEST_JOINTS = 5
"""Number of joints of an arm that finds the angle about the axis together with its joints."""


def _turns() -> FloatArray:
    """Return angles about an axis in the order in which they are tried [rad].

    The first FEW and the first ANGLES divide a turn evenly, and so do all together.
    """
    finest = ANGLES * SUBDIVISIONS
    # A multiple of a number without common divisor jumps around the circle.
    order = (37 * np.arange(finest)) % finest
    is_few, is_angle = order % (finest // FEW) == 0, order % SUBDIVISIONS == 0
    parts = order[is_few], order[is_angle & ~is_few], order[~is_angle]
    return FULL_TURN / finest * np.concatenate(parts)


TURNS = _turns()


class Poses(NamedTuple):
    """The poses of a freedom: its samples, then further ones next to those."""

    u: FloatArray
    """Parameters of each pose [rad and m], shape (n, PARAMETERS)."""
    samples: int
    """Number of samples."""
    parents: IntArray
    """The two samples next to each pose, itself for a sample, shape (n, 2)."""
    child_first: IntArray
    """First of the further poses next to each pose in `children`, and their number, shape
    (n + 1,)."""
    children: IntArray
    """Further poses by their numbers: each twice, unless both its samples are one."""


COARSE = 0.75
"""Part of the greatest tilt at which some tilts are tried although another one reaches the goal."""


def coarse_tilts(form: FloatArray, u: FloatArray) -> BoolArray:
    """Return whether samples of a cone are every second one of a ring near its rim, shape (n,)."""
    tilt = np.hypot(u[:, 1], u[:, 2])
    found = np.zeros(len(u), np.bool_)
    rings = TILTS[form[TILT] + WITHIN >= TILTS]
    if len(rings):
        ring = rings[np.argmin(np.abs(rings - COARSE * form[TILT]))]
        alone = np.all(u[:, [0, 3, 4, 5]] == 0.0, axis=1) & (np.abs(tilt - ring) < WITHIN)
        # The further poses follow the samples, half-way between them.
        number = AROUND[int(np.argmin(np.abs(TILTS - ring)))]
        found[np.flatnonzero(alone)[:number:2]] = True
    return found


def spacing(form: FloatArray) -> FloatArray:
    """Return the steps from which the best pose is refined, 0 where not free, shape (6,)."""
    step = np.zeros(PARAMETERS)
    others = form[TILT] > 0.0 or np.any(form[HALF : HALF + 3] > 0.0)
    step[0] = FULL_TURN / ANGLES * (4.0 if others else 1.0) if form[ROTATES] else 0.0
    step[1:3] = min(form[TILT], WIDEST_STEP)
    step[3:6] = form[HALF : HALF + 3]
    return step


@lru_cache(maxsize=64)
def poses_of(key: bytes) -> Poses:
    """Return the poses of a freedom, whose row of `FreeGoals.form` has these bytes.

    What is sampled, and which further poses are next to a sample, is the same in every freedom that
    contains them: the poses of a freedom are among those of a wider one about the same axis, but
    for those where any orientation serves.
    """
    form = np.frombuffer(key)
    if form[TILT] < np.pi:
        samples, more, near = _sampled(form)
    else:
        samples, more, near = _of_any_orientation(form)
    # A pose between two samples is listed with both, one about a sample once.
    listed = np.ones(near.shape, bool)
    listed[:, 1] = near[:, 0] != near[:, 1]
    number = np.arange(len(samples), len(samples) + len(more))
    pose = np.repeat(number[:, None], 2, axis=1)[listed]
    order = np.argsort(near[listed], kind="stable")
    counts = np.bincount(near[listed], minlength=len(samples) + len(more))
    own = np.repeat(np.arange(len(samples))[:, None], 2, axis=1)
    return Poses(
        u=np.concatenate([samples, more]),
        samples=len(samples),
        parents=np.concatenate([own, near]).astype(np.int64),
        child_first=np.cumsum([0, *counts]),
        children=pose[order].astype(np.int64),
    )


def _sampled(form: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return samples, further poses next to them, and the two samples next to each of these.

    Tilts and displacements are those of `TILTS` and `DISPLACEMENTS` within the bounds, the nominal
    pose first. All are sampled alone, some together.
    """
    tilts = np.concatenate([[[0.0, 0.0]], *map(_ring, TILTS, AROUND)])
    tilt_within = np.hypot(tilts[:, 0], tilts[:, 1]) <= form[TILT] + WITHIN
    every = np.arange(0.0, ANGLES) if form[ROTATES] else np.arange(form[FOLD]) * ANGLES / form[FOLD]
    rows = []
    for angle in every if form[ROTATES] or form[FOLD] > 1 else [0.0]:
        mixes = not form[ROTATES] or angle % MIXED == 0
        for i in np.flatnonzero(tilt_within) if mixes else [0]:
            if i > 0 and angle % (ANGLES / 2) != 0 and (i + round(angle)) % AT_ANGLE:
                continue
            moved = _displacements(form, int(i), float(angle)) if mixes else np.zeros((1, 3))
            row = np.zeros((len(moved), PARAMETERS))
            row[:, 0], row[:, 1:3], row[:, 3:6] = angle * FULL_TURN / ANGLES, tilts[i], moved
            rows.append(row)
    samples = np.concatenate(rows)
    more, near = [], []
    for n, u in enumerate(samples):
        if form[ROTATES] and not np.any(u[1:]):
            # The samples of the angle alone are in order.
            following = np.flatnonzero(~np.any(samples[:, 1:], axis=1))
            after = following[(np.searchsorted(following, n) + 1) % ANGLES]
            for part in range(1, SUBDIVISIONS):
                step = part / SUBDIVISIONS * FULL_TURN / ANGLES
                more.append(u + step * np.eye(PARAMETERS)[0])
                near.append((n, after))
        for moved in _beside(form, u):
            more.append(moved)
            near.append((n, n))
    return (
        samples,
        np.array(more, dtype=np.float64).reshape(-1, PARAMETERS),
        np.array(near, dtype=np.int64).reshape(-1, 2),
    )


def _ring(tilt: float, count: int) -> FloatArray:
    """Return tilts in directions around the axis [rad], shape (count, 2)."""
    # Neighbouring rings are turned against each other.
    azimuth = FULL_TURN * (np.arange(count) + 0.5 * (count % 4 == 0)) / count
    return tilt * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)


def _displacements(form: FloatArray, tilt: int, angle: float) -> FloatArray:
    """Return the displacements in the box that are sampled at a rotation, shape (n, 3).

    Args:
        form: Row of `FreeGoals.form`.
        tilt: Number of the tilt.
        angle: Number of the angle about the axis, in `ANGLES` of a turn.
    """
    every = _all_displacements()
    taken = np.all(np.abs(every) <= form[HALF : HALF + 3] + WITHIN, axis=1)
    if tilt or angle:
        one_in = np.array(AT_ROTATION)[np.count_nonzero(every, axis=1)]
        one_in = np.maximum(one_in * (AT_BOTH if tilt and angle else 1), 1)
        taken &= (7 * tilt + 3 * round(angle) + np.arange(len(every))) % one_in == 0
    return every[taken]


@lru_cache(maxsize=1)
def _all_displacements() -> FloatArray:
    """Return no displacement, and those along one axis, two and three, shape (n, 3)."""
    steps = len(DISPLACEMENTS)
    found = [np.zeros((1, 3))]
    for axes in ((0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)):
        for number, step in enumerate(np.ndindex(*[steps] * len(axes))):
            # Two opposite corners, of all in turn.
            corner = number + number // steps
            sides = [(corner >> k) % 2 * 2 - 1 for k in range(len(axes))]
            at = np.zeros((2, 3))
            at[:, axes] = DISPLACEMENTS[list(step)] * np.array([sides, np.negative(sides)])
            found.append(at)
    return np.concatenate(found)


def _beside(form: FloatArray, u: FloatArray) -> list[FloatArray]:
    """Return poses half-way from a sample to the next ones along each parameter.

    Samples of more than one of rotation, tilt and displacement are many, and have none; half a turn
    counts as no rotation.
    """
    found = []
    tilt = float(np.hypot(u[1], u[2]))
    is_rotated = u[0] != 0.0 and u[0] != FULL_TURN / 2.0
    if sum(map(int, (is_rotated, tilt > 0.0, np.any(u[3:6])))) > 1:
        return []
    if form[TILT] > 0.0 and tilt == 0.0:
        for x, y in _ring(0.5 * float(TILTS[0]), AROUND[0]):
            moved = u.copy()
            moved[1:3] = x, y
            found.append(moved)
    elif form[TILT] > 0.0:
        for at in _half_way(TILTS, tilt):
            moved = u.copy()
            moved[1:3] *= at / tilt
            found.append(moved)
        half = np.pi / AROUND[int(np.argmin(np.abs(TILTS - tilt)))]
        for side in (-half, half):
            c, s = np.cos(side), np.sin(side)
            moved = u.copy()
            moved[1], moved[2] = c * u[1] - s * u[2], s * u[1] + c * u[2]
            found.append(moved)
    for k in range(3, PARAMETERS):
        if form[HALF + k - 3] > 0.0:
            far = abs(u[k])
            for at in _half_way(DISPLACEMENTS, far) if far else (0.5 * float(DISPLACEMENTS[0]),):
                for side in (np.sign(u[k]),) if far else (-1.0, 1.0):
                    moved = u.copy()
                    moved[k] = side * at
                    found.append(moved)
    return [moved for moved in found if _is_within(form, moved)]


def _half_way(steps: FloatArray, at: float) -> list[float]:
    """Return what is half-way from one of some steps to those before and after it."""
    number = int(np.argmin(np.abs(steps - at)))
    before = steps[number - 1] if number else 0.0
    after = [0.5 * (at + steps[number + 1])] if number + 1 < len(steps) else []
    return [0.5 * (at + before), *after]


def _is_within(form: FloatArray, u: FloatArray) -> bool:
    """Return whether parameters are within a freedom."""
    half = form[HALF : HALF + 3]
    is_tilted = np.hypot(u[1], u[2]) > form[TILT] + WITHIN
    return not is_tilted and bool(np.all(np.abs(u[3:6]) <= half + WITHIN))


def _of_any_orientation(form: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return what `_sampled` does, for a tool of any orientation.

    The further poses go on where the sequence of the samples ends, so that all together are spread
    evenly. Displaced poses are samples only.
    """
    samples = ORIENTATIONS if form[ROTATES] else DIRECTIONS
    u = _orientations_spread(form, 1 + (1 + FURTHER) * (samples - 1))
    here, more = u[:samples], u[samples:]
    quaternions = orientations(form, here).as_quat()
    # A rotation is a unit quaternion or its negative.
    tree = cKDTree(np.concatenate([quaternions, -quaternions]))
    near = tree.query(orientations(form, more).as_quat(), k=2)[1] % samples
    displaced = [here]
    for n, one in enumerate(here):
        moved = _displacements(form, n, float(n > 0))[1:]
        row = np.repeat(one[None], len(moved), axis=0)
        row[:, 3:6] = moved
        displaced.append(row)
    return np.concatenate(displaced), more, near.astype(np.int64)


def _orientations_spread(form: FloatArray, count: int) -> FloatArray:
    """Return the nominal pose and a low-discrepancy sequence of any orientation, (count, 6)."""
    unit = spread(count - 1, 3 if form[ROTATES] else 2)
    u = np.zeros((count, PARAMETERS))
    if form[ROTATES]:
        u[1:, 0] = FULL_TURN * unit[:, 0]
    angle, azimuth = np.arccos(1.0 - 2.0 * unit[:, -2]), FULL_TURN * unit[:, -1]
    u[1:, 1], u[1:, 2] = angle * np.cos(azimuth), angle * np.sin(azimuth)
    return u


def wrist_positions(form: FloatArray, u: FloatArray, wrist: FloatArray) -> FloatArray:
    """Return positions in the frame of the goal [m], shape (n, 3), of a point of the tool.

    Args:
        form: Row of `FreeGoals.form`.
        u: Parameters, shape (n, PARAMETERS).
        wrist: The point in T [m], shape (3,).
    """
    return np.array(u[:, 3:6] + orientations(form, u).apply(wrist))


def orientations(form: FloatArray, u: FloatArray) -> Rotation:
    """Return the orientations R_GT of poses; the arguments are those of `wrist_positions`."""
    tilt = Rotation.from_rotvec(u[:, 1:2] * form[9:12] + u[:, 2:3] * form[12:15])
    return tilt * Rotation.from_rotvec(u[:, :1] * form[AXIS : AXIS + 3])


@inner
def pose_of(
    form: FloatArray,
    u: FloatArray,
    R_WG: FloatArray,
    p_WG: FloatArray,
    R_WT: FloatArray,
    p_WT: FloatArray,
) -> None:
    """Fill the tool pose in W of the parameters u of a goal's freedom.

    Args:
        form: Row of `FreeGoals.form`.
        u: Parameters, shape (PARAMETERS,).
        R_WG: Nominal orientation of the goal, shape (3, 3).
        p_WG: Nominal position of the goal [m], shape (3,).
        R_WT: Filled, shape (3, 3).
        p_WT: Filled [m], shape (3,).
    """
    x = u[1] * form[9] + u[2] * form[12]
    y = u[1] * form[10] + u[2] * form[13]
    z = u[1] * form[11] + u[2] * form[14]
    tilt = np.empty((3, 3))
    angle = np.sqrt(x * x + y * y + z * z)
    if angle > 0.0:
        x, y, z = x / angle, y / angle, z / angle
    _rotation(x, y, z, angle, tilt)
    about = np.empty((3, 3))
    _rotation(form[0], form[1], form[2], u[0], about)
    for r in range(3):
        p_WT[r] = p_WG[r] + R_WG[r, 0] * u[3] + R_WG[r, 1] * u[4] + R_WG[r, 2] * u[5]
    for r in range(3):
        for c in range(3):
            total = 0.0
            for k in range(3):
                part = (
                    tilt[k, 0] * about[0, c] + tilt[k, 1] * about[1, c] + tilt[k, 2] * about[2, c]
                )
                total += R_WG[r, k] * part
            R_WT[r, c] = total


@inner
def turned_about(R: FloatArray, axis: FloatArray, angle: float, out: FloatArray) -> None:
    """Fill R Rot(axis, angle), shape (3, 3), with a unit axis and an angle [rad]."""
    about = np.empty((3, 3))
    _rotation(axis[0], axis[1], axis[2], angle, about)
    for r in range(3):
        for c in range(3):
            out[r, c] = R[r, 0] * about[0, c] + R[r, 1] * about[1, c] + R[r, 2] * about[2, c]


@inner
def _rotation(x: float, y: float, z: float, angle: float, R: FloatArray) -> None:
    """Fill the rotation by an angle [rad] about the unit vector (x, y, z), shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    v = 1.0 - c
    R[0, 0], R[0, 1], R[0, 2] = c + v * x * x, v * x * y - s * z, v * x * z + s * y
    R[1, 0], R[1, 1], R[1, 2] = v * x * y + s * z, c + v * y * y, v * y * z - s * x
    R[2, 0], R[2, 1], R[2, 2] = v * x * z - s * y, v * y * z + s * x, c + v * z * z
