"""Freedom of each goal as numbers, and the tool poses sampled from it.

A pose of the freedom has six parameters u: the rotation angle about the axis, the two components of
the tilt (a rotation vector perpendicular to the axis), and the displacement,
R_GT = exp(u1 e1 + u2 e2) Rot(axis, u0), p_GT = (u3, u4, u5), where e1, e2 and the axis are
perpendicular. Parameters that are not free are zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray, IntArray
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
ORIENTATIONS = 384
"""Least number of samples of a tool that may have any orientation: its angles range over full
turns, and with 96 a PR2 missed 7 % of the pairs that it reaches with 384."""
SUBDIVISIONS = 4
"""Parts into which the spacing of the samples is divided where none of them reaches a goal."""
TO_THE_RIM = 4.0 / 3.0
"""Factor that spreads samples of tilts and positions before they are clipped to the bounds."""
FULL_TURN = 2.0 * np.pi


class FreeGoals(NamedTuple):
    """The freedom of the goals of a problem; `first` is empty if no goal is free.

    The poses of a goal are its samples, then further ones near those: `parents` names the samples
    between which they lie.
    """

    form: FloatArray
    """Columns as above, then the unit vectors e1 and e2, shape (goals, COLUMNS + 6)."""
    step: FloatArray
    """Spacing of the samples of each parameter [rad or m], 0 where not free, shape
    (goals, PARAMETERS)."""
    first: IntArray
    """First pose of each goal, and the number of poses, shape (goals + 1,)."""
    samples: IntArray
    """Number of samples of each goal, shape (goals,)."""
    parents: IntArray
    """The two samples of the goal, by their numbers, next to each pose, shape (poses, 2)."""
    u: FloatArray
    """Parameters of each pose [rad and m], shape (poses, PARAMETERS)."""
    reach: float
    """Upper bound of the distance of the tool from the first joint [m]."""


def no_freedom() -> FreeGoals:
    """Return the freedom of a problem in which no goal is free."""
    return FreeGoals(
        form=np.empty((0, COLUMNS + 6)),
        step=np.empty((0, PARAMETERS)),
        first=np.empty(0, np.int64),
        samples=np.empty(0, np.int64),
        parents=np.empty((0, 2), np.int64),
        u=np.empty((0, PARAMETERS)),
        reach=np.inf,
    )


def free_goals(rows: FloatArray, chain: Chain) -> FreeGoals:
    """Return the freedom of goals, with their sampled poses.

    Args:
        rows: The freedom of each goal, shape (goals, COLUMNS); a row of zeros for none.
        chain: The arm.
    """
    if not np.any(rows):
        return no_freedom()
    slides = chain.slides > 0.0
    farthest = np.maximum(np.abs(chain.lower), np.abs(chain.upper))
    longest = float(farthest[slides] @ chain.slides[slides])
    forms, steps, first, samples, parents, poses = [], [], [0], [], [], []
    for row in rows:
        form = np.concatenate([row, *_basis(row)])
        step = spacing(form)
        base = sampled(form, step)
        more, near = _between(form, step, base)
        forms.append(form)
        steps.append(step)
        samples.append(len(base))
        own = np.repeat(np.arange(len(base))[:, None], 2, axis=1)
        parents.append(np.concatenate([own, near]))
        poses.append(np.concatenate([base, more]))
        first.append(first[-1] + len(poses[-1]))
    return FreeGoals(
        form=np.array(forms),
        step=np.array(steps),
        first=np.array(first, np.int64),
        samples=np.array(samples, np.int64),
        parents=np.concatenate(parents).astype(np.int64),
        u=np.ascontiguousarray(np.concatenate(poses)),
        reach=float(np.linalg.norm(chain.p, axis=1).sum() + longest),
    )


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
    is_any_orientation = form[ROTATES] and form[TILT] >= np.pi
    return max(count, ORIENTATIONS) if is_any_orientation else count


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
    free = free_parameters(form)
    count = sample_count(form)
    u = np.zeros((count, PARAMETERS))
    if free == [0]:
        u[:, 0] = np.arange(count) * step[0]
    elif free:
        unit = spread(count - 1, len(free))
        for k, parameter in enumerate(free):
            if parameter == 0:
                u[1:, 0] = FULL_TURN * unit[:, k]
            elif parameter == 1:
                cap = np.minimum(TO_THE_RIM * unit[:, k], 1.0)
                angle = np.arccos(1.0 - (1.0 - np.cos(form[TILT])) * cap)
                azimuth = FULL_TURN * unit[:, k + 1]
                u[1:, 1], u[1:, 2] = angle * np.cos(azimuth), angle * np.sin(azimuth)
            elif parameter > 2:
                along = np.clip(TO_THE_RIM * (2.0 * unit[:, k] - 1.0), -1.0, 1.0)
                u[1:, parameter] = along * form[HALF + parameter - 3]
    if form[ROTATES] or form[FOLD] <= 1:
        return u
    turns = []
    for k in range(int(form[FOLD])):
        turned = u.copy()
        turned[:, 0] = k * FULL_TURN / form[FOLD]
        turns.append(turned)
    return np.concatenate(turns)


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


def _basis(row: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two unit vectors perpendicular to the axis and to each other."""
    axis = row[AXIS : AXIS + 3]
    if not np.any(axis):
        return np.zeros(3), np.zeros(3)
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first = first / np.linalg.norm(first)
    return first, np.cross(axis, first)


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
def _rotation(x: float, y: float, z: float, angle: float, R: FloatArray) -> None:
    """Fill the rotation by an angle [rad] about the unit vector (x, y, z), shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    v = 1.0 - c
    R[0, 0], R[0, 1], R[0, 2] = c + v * x * x, v * x * y - s * z, v * x * z + s * y
    R[1, 0], R[1, 1], R[1, 2] = v * x * y + s * z, c + v * y * y, v * y * z - s * x
    R[2, 0], R[2, 1], R[2, 2] = v * x * z - s * y, v * y * z + s * x, c + v * z * z
