"""Constants of the closed-form inverse kinematics of a seven-joint arm, computed once per arm.

The spherical-wrist class: seven revolute joints; axes 2 and 3 meet (point S, the shoulder); axes 5,
6 and 7 meet (point W, the wrist); other offsets are arbitrary. Joint 1 is the free parameter. Given
its angle,

* joint 4 follows from the distance |SW|, which depends on nothing else,
* joints 2 and 3 aim the vector SW, and
* joints 5, 6 and 7 are a spherical wrist,

each with two solutions in general: a branch is a triple of signs.

The spherical-shoulder class: axes 1, 2 and 3 meet, and axes 5 and 6 meet. Such an arm is solved as
the reversed chain, from tool to base: its joints are in the order 7 .. 1, joint 7 is free, and the
goal pose is inverted. `ik` converts the goal and the joints.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from tcs.errors import ArmClassError
from tcs.kernel.arrays import Chain, FloatArray, IntArray
from tcs.kernel.lines import axis_distance

MEETING_TOLERANCE = 1e-9
"""Greatest distance [m] of axes that count as meeting. Lowering places the link frames of meeting
axes at one point, so only rounding remains; the smallest offset of a real arm is millimetres."""


FIRST, LAST = 0, 6
"""Indices of the joints that may be free."""


class ArmSolver(NamedTuple):
    """Constants of the closed form of one arm. L1..L7 as in `Chain`; u is SW expressed in L3.

    For the spherical-shoulder class all fields except `free`, `lower` and `upper` describe the
    reversed chain.
    """

    free: int
    """Index of the free joint in the real arm: FIRST, or LAST for a reversed chain."""
    R: FloatArray
    """Rotations of the chain as solved, shape (8, 3, 3)."""
    p: FloatArray
    """Translations of the chain as solved [m], shape (8, 3)."""
    u0: FloatArray
    """u = u0 + uc cos(q4) + us sin(q4) [m], shape (3,)."""
    uc: FloatArray
    us: FloatArray
    reach: FloatArray
    """|u|^2 = reach[0] + reach[1] cos(q4 - phase) [m^2], with phase = reach[2] [rad]."""
    phase: FloatArray
    """Cosine and sine of that phase, shape (2,)."""
    elbow_cos: FloatArray
    """Least and greatest cos(q4 - phase) within the limits of joint 4, shape (2,)."""
    limit_cos: FloatArray
    """A limited joint is within its limits when cos(q - middle) >= limit_cos; shape (7,).
    -1 for a joint whose range is a full turn or more."""
    middle_cos: FloatArray
    """cos(middle of the limits), 0 where there are none, shape (7,)."""
    middle_sin: FloatArray
    """sin(middle of the limits), 0 where there are none, shape (7,)."""
    lower: FloatArray
    """Joint limits [rad] in the real arm's order, shape (7,); infinite where continuous."""
    upper: FloatArray
    branches: IntArray
    """Signs of sin(q4 - phase), of the aim and of the wrist that occur within the limits, shape
    (branches, 3)."""


def arm_solver(chain: Chain) -> ArmSolver:
    """Return the closed-form constants of `chain`.

    An arm in both classes, such as one with a spherical shoulder and a spherical wrist, is solved
    as one of the spherical-wrist class.

    Raises:
        ArmClassError: If the arm is outside both classes (the message lists the axes that fail to
            meet, and by how much), or if its elbow does not change the distance |SW|.
    """
    misses = _misses(chain, (2, 3), (5, 6, 7))
    shoulder_misses = _misses(chain, (1, 2, 3), (5, 6))
    if misses and shoulder_misses:
        raise ArmClassError(
            "the arm is outside the closed-form classes. The spherical-wrist class needs axes 2 "
            f"and 3 to meet, and 5, 6 and 7 in one point, but {'; '.join(misses)}. The "
            "spherical-shoulder class needs axes 1, 2 and 3 to meet in one point, and 5 and 6, but "
            f"{'; '.join(shoulder_misses)}."
        )
    real = chain
    if misses:
        chain = reversed_chain(chain)
    w = chain.p[4]
    R3 = chain.R[3]
    u0 = chain.p[3] + R3[:, 2] * w[2]
    uc = R3[:, 0] * w[0] + R3[:, 1] * w[1]
    us = -R3[:, 0] * w[1] + R3[:, 1] * w[0]
    # uc and us are orthogonal and of equal length, so |u|^2 is a single cosine of q4.
    swing = 2.0 * np.array([u0 @ uc, u0 @ us])
    amplitude = float(np.hypot(*swing))
    if amplitude < MEETING_TOLERANCE:
        raise ArmClassError(
            "the elbow (joint 4) does not change the distance from shoulder to wrist: "
            "the closed form cannot solve this arm."
        )
    phase = float(np.arctan2(swing[1], swing[0]))
    lower, upper = chain.lower, chain.upper
    limited = upper - lower < 2.0 * np.pi
    middle = np.where(limited, 0.5 * (np.where(limited, lower, 0) + np.where(limited, upper, 0)), 0)
    half = np.where(limited, 0.5 * (np.where(limited, upper - lower, 0)), np.pi)
    elbow_signs = _signs_within(lower[3] - phase, upper[3] - phase, bool(limited[3]))
    wrist_signs = [1, -1]
    if limited[5]:
        f = chain.R[6][:, 2]
        row = chain.R[5][2]
        wrist_phase = np.arctan2(row[1] * f[0] - row[0] * f[1], row[0] * f[0] + row[1] * f[1])
        wrist_signs = _signs_within(lower[5] - wrist_phase, upper[5] - wrist_phase, True)
    branches = [(e, a, w_) for e in elbow_signs for a in (1, -1) for w_ in wrist_signs]
    return ArmSolver(
        free=LAST if misses else FIRST,
        R=np.array(chain.R, order="C"),
        p=np.array(chain.p, order="C"),
        u0=u0,
        uc=uc,
        us=us,
        reach=np.array([u0 @ u0 + uc @ uc, amplitude, phase]),
        phase=np.array([np.cos(phase), np.sin(phase)]),
        elbow_cos=cos_range(lower[3] - phase, upper[3] - phase, bool(limited[3])),
        limit_cos=np.where(limited, np.cos(half), -1.0),
        middle_cos=np.where(limited, np.cos(middle), 0.0),
        middle_sin=np.where(limited, np.sin(middle), 0.0),
        lower=np.array(real.lower, dtype=np.float64),
        upper=np.array(real.upper, dtype=np.float64),
        branches=np.array(branches, dtype=np.int64),
    )


def outside_solver(chain: Chain) -> ArmSolver:
    """Return a solver with the chain and limits of an arm outside the closed-form classes.

    It has no branches, which is what `is_outside` tests; the constants of the closed form are zero.
    """
    none = np.zeros(3)
    return ArmSolver(
        free=FIRST,
        R=np.array(chain.R, order="C"),
        p=np.array(chain.p, order="C"),
        u0=none,
        uc=none.copy(),
        us=none.copy(),
        reach=none.copy(),
        phase=none.copy(),
        elbow_cos=np.zeros(2),
        limit_cos=np.zeros(7),
        middle_cos=np.zeros(7),
        middle_sin=np.zeros(7),
        lower=np.array(chain.lower, dtype=np.float64),
        upper=np.array(chain.upper, dtype=np.float64),
        branches=np.zeros((0, 3), dtype=np.int64),
    )


def any_solver(chain: Chain) -> ArmSolver:
    """Return `arm_solver(chain)`, or `outside_solver(chain)` for an arm without a closed form.

    An arm of six joints counts as one: `tcs.kernel.six_joints` solves it.
    """
    if chain.joints != 7:
        return outside_solver(chain)
    try:
        return arm_solver(chain)
    except ArmClassError:
        return outside_solver(chain)


def is_outside(arm: ArmSolver) -> bool:
    """Return whether an arm is outside the closed-form classes, so that numeric IK solves it."""
    return len(arm.branches) == 0


def reversed_chain(chain: Chain) -> Chain:
    """Return the arm reversed, from tool to base: its arm base is T and its tool is A.

    Joint i of the result is joint 8 - i of `chain`, with the same angle: a half turn about x on
    either side of every joint restores its sense of rotation.
    """
    R = np.swapaxes(chain.R[::-1], 1, 2)
    p = -np.einsum("ijk,ik->ij", R, chain.p[::-1])
    half_turn = np.diag([1.0, -1.0, -1.0])
    before, after = np.stack([half_turn] * 8), np.stack([half_turn] * 8)
    before[0] = after[7] = np.eye(3)
    return Chain(
        R=np.ascontiguousarray(before @ R @ after),
        p=np.einsum("ijk,ik->ij", before, p),
        lower=chain.lower[::-1].copy(),
        upper=chain.upper[::-1].copy(),
    )


def _misses(chain: Chain, *groups: tuple[int, ...]) -> list[str]:
    """Return why groups of axes fail to meet, each group in one point; empty if all meet.

    Args:
        chain: The arm.
        groups: Numbers of two or three consecutive axes.
    """
    found = []
    for axes in groups:
        passes = [axis_distance(chain.R[i], chain.p[i]) for i in axes[:-1]]
        reasons = []
        for i, passing in zip(axes, passes, strict=False):
            if passing is None:
                reasons.append(f"axes {i} and {i + 1} are parallel")
            elif passing[0] > MEETING_TOLERANCE:
                reasons.append(f"axes {i} and {i + 1} pass each other {passing[0]:.3g} m apart")
        met = [passing for passing in passes if passing is not None]
        slips = [abs(after[1] - before[2]) for before, after in itertools.pairwise(met)]
        if not reasons and max(slips, default=0.0) > MEETING_TOLERANCE:
            reasons.append(f"axis {axes[1]} meets {axes[0]} and {axes[2]} {slips[0]:.3g} m apart")
        if not reasons and np.abs(chain.p[list(axes[:-1])]).max() > MEETING_TOLERANCE:
            names = ", ".join(f"L{i}" for i in axes)
            reasons.append(f"link frames {names} do not lie where their axes meet")
        found += reasons
    return found


def _signs_within(lower: float, upper: float, limited: bool) -> list[int]:
    """Return the signs that the sine takes on [lower, upper] [rad]."""
    if not limited:
        return [1, -1]
    # sin is >= 0 on [2k pi, (2k + 1) pi]: list the half turns that intersect [lower, upper].
    first = np.floor(lower / np.pi)
    halves = {int(k) % 2 for k in np.arange(first, np.floor(upper / np.pi) + 1)}
    return [sign for sign, half in ((1, 0), (-1, 1)) if half in halves]


def cos_range(lower: float, upper: float, limited: bool) -> FloatArray:
    """Return the least and the greatest cosine on [lower, upper] [rad], shape (2,)."""
    if not limited:
        return np.array([-1.0, 1.0])
    ends = np.cos([lower, upper])
    least = -1.0 if np.floor((upper - np.pi) / (2 * np.pi)) >= (lower - np.pi) / (2 * np.pi) else 0
    most = 1.0 if np.floor(upper / (2 * np.pi)) >= lower / (2 * np.pi) else 0
    return np.array([least or ends.min(), most or ends.max()])
