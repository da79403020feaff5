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

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.low_discrepancy import spread

AXIS, ROTATES, FOLD, TILT, HALF = 0, 3, 4, 5, 6
"""Columns of a freedom: unit axis, whether the angle about it is free, number of equivalent angles,
greatest tilt [rad], greatest displacements [m]."""
COLUMNS = 9
PARAMETERS = 6
ANGLES = 24
"""Samples of a free angle about an axis: one every 15 degrees."""
SAMPLES = (1, ANGLES, 32, 96, 192, 256, 256)
"""Number of samples by the number of free parameters."""
ORIENTATIONS = 288
"""Least number of samples of a tool that may have any orientation: its angles range over full
turns."""
SUBDIVISIONS = 4
"""Parts into which the spacing of the samples is divided where none of them reaches a goal."""
TO_THE_RIM = 4.0 / 3.0
"""Factor that spreads samples of tilts and positions before they are clipped to the bounds."""
FURTHER = 20
"""Further poses for each sample of a tool that may have any orientation."""
MIRROR = np.array([-1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
"""Factors of the coordinates of the same pose by the other quaternion."""
FULL_TURN = 2.0 * np.pi
TILTS = 96
"""Number of samples of the direction of the axis for such an arm if it may be any."""
FEWEST_JOINTS = 5
"""Number of joints of an arm that finds the angle about the axis together with its joints."""


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


def spacing(form: FloatArray) -> FloatArray:
    """Return the spacing of the samples of each parameter, 0 where not free, shape (6,)."""
    step = np.zeros(PARAMETERS)
    free = free_parameters(form)
    along = sample_count(form) ** (1.0 / max(len(free), 1))
    step[0] = FULL_TURN / (ANGLES if len(free) == 1 else along) if form[ROTATES] else 0.0
    step[1:3] = 2.0 * form[TILT] / along
    step[3:6] = 2.0 * form[HALF : HALF + 3] / along
    return step


def sample_count(form: FloatArray) -> int:
    """Return the number of samples of a freedom, for each of its equivalent angles."""
    count = SAMPLES[len(free_parameters(form))]
    if form[TILT] < np.pi:
        return count
    return max(count, ORIENTATIONS if form[ROTATES] else TILTS)


def free_parameters(form: FloatArray) -> list[int]:
    """Return the numbers of the parameters that vary continuously."""
    free = [0] if form[ROTATES] else []
    free += [1, 2] if form[TILT] > 0.0 else []
    return free + [3 + i for i in range(3) if form[HALF + i] > 0.0]


def sampled(form: FloatArray, step: FloatArray) -> FloatArray:
    """Return the samples of a freedom, the nominal pose first, shape (n, PARAMETERS).

    One free angle is sampled evenly; several parameters by a low-discrepancy sequence, tilts evenly
    on the sphere, with a quarter of the samples at the greatest tilt and on each pair of faces of
    the box, where goals at the edge of the workspace are reached. Each equivalent angle of a
    symmetric tool has the same samples.
    """
    count = sample_count(form)
    if free_parameters(form) == [0]:
        u = np.zeros((count, PARAMETERS))
        u[:, 0] = np.arange(count) * step[0]
    else:
        u = _spread_over(form, count)
    if form[ROTATES] or form[FOLD] <= 1:
        return u
    turns = []
    for k in range(int(form[FOLD])):
        turned = u.copy()
        turned[:, 0] = k * FULL_TURN / form[FOLD]
        turns.append(turned)
    return np.concatenate(turns)


def _spread_over(form: FloatArray, count: int) -> FloatArray:
    """Return the nominal pose and a low-discrepancy sequence of others, shape (count, 6)."""
    free = free_parameters(form)
    u = np.zeros((count, PARAMETERS))
    if not free:
        return u
    unit = spread(count - 1, len(free))
    for k, parameter in enumerate(free):
        if parameter == 0:
            u[1:, 0] = FULL_TURN * unit[:, k]
        elif parameter == 1:
            # The rim of all directions is a single one.
            factor = TO_THE_RIM if form[TILT] < np.pi else 1.0
            cap = np.minimum(factor * unit[:, k], 1.0)
            angle = np.arccos(1.0 - (1.0 - np.cos(form[TILT])) * cap)
            azimuth = FULL_TURN * unit[:, k + 1]
            u[1:, 1], u[1:, 2] = angle * np.cos(azimuth), angle * np.sin(azimuth)
        elif parameter > 2:
            along = np.clip(TO_THE_RIM * (2.0 * unit[:, k] - 1.0), -1.0, 1.0)
            u[1:, parameter] = along * form[HALF + parameter - 3]
    return u


@lru_cache(maxsize=64)
def poses_of(key: bytes) -> Poses:
    """Return the poses of a freedom, whose row of `FreeGoals.form` has these bytes."""
    form = np.frombuffer(key)
    step = spacing(form)
    samples = sampled(form, step)
    if form[TILT] < np.pi:
        more, near = _between(form, step, samples)
    else:
        more, near = _next_to(form, samples)
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


def _next_to(form: FloatArray, samples: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return further poses of a tool of any orientation, and the two samples nearest to each.

    They go on where the sequence of the samples ends, so that all together are spread evenly.
    """
    count = 1 + (1 + FURTHER) * (len(samples) - 1)
    more, here = _spread_over(form, count)[len(samples) :], _coordinates(form, samples)
    # A rotation is a unit quaternion or its negative.
    both = np.concatenate([here, here * MIRROR])
    near = cKDTree(both).query(_coordinates(form, more), k=2)[1] % len(here)
    return more, near.astype(np.int64)


def _coordinates(form: FloatArray, u: FloatArray) -> FloatArray:
    """Return points whose distances are those of poses: quaternions, and positions in the box."""
    half = form[HALF : HALF + 3]
    inside = u[:, 3:6] / np.where(half > 0.0, half, 1.0)
    return np.concatenate([_orientations(form, u).as_quat(), inside], axis=1)


def wrist_positions(form: FloatArray, u: FloatArray, wrist: FloatArray) -> FloatArray:
    """Return positions in the frame of the goal [m], shape (n, 3), of a point of the tool.

    Args:
        form: Row of `FreeGoals.form`.
        u: Parameters, shape (n, PARAMETERS).
        wrist: The point in T [m], shape (3,).
    """
    return np.array(u[:, 3:6] + _orientations(form, u).apply(wrist))


def _orientations(form: FloatArray, u: FloatArray) -> Rotation:
    """Return the orientations R_GT of poses."""
    tilt = Rotation.from_rotvec(u[:, 1:2] * form[9:12] + u[:, 2:3] * form[12:15])
    return tilt * Rotation.from_rotvec(u[:, :1] * form[AXIS : AXIS + 3])


def _between(
    form: FloatArray, step: FloatArray, samples: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Return further poses between or about samples, and the two samples next to each."""
    free = free_parameters(form)
    poses, near = [], []
    if free == [0]:
        for part in range(1, SUBDIVISIONS):
            for i, u in enumerate(samples):
                moved = u.copy()
                moved[0] += step[0] * part / SUBDIVISIONS
                poses.append(moved)
                near.append((i, (i + 1) % len(samples)))
    else:
        for i, u in enumerate(samples):
            for parameter in free:
                for sign in (1.0, -1.0):
                    moved = u.copy()
                    moved[parameter] += sign * 0.5 * step[parameter]
                    if _is_within(form, moved):
                        poses.append(moved)
                        near.append((i, i))
    return (
        np.array(poses, dtype=np.float64).reshape(-1, PARAMETERS),
        np.array(near, dtype=np.int64).reshape(-1, 2),
    )


def _is_within(form: FloatArray, u: FloatArray) -> bool:
    """Return whether parameters are within a freedom."""
    half = form[HALF : HALF + 3]
    return bool(np.hypot(u[1], u[2]) <= form[TILT] and np.all(np.abs(u[3:6]) <= half))


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
