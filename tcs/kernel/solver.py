"""Closed-form inverse kinematics of a seven-joint arm: what can be worked out once per arm.

The class: seven revolute joints; axes 2 and 3 meet (point S, the shoulder); axes 5, 6 and 7 meet
(point W, the wrist); any other offsets. Joint 1 is the free parameter. Given its angle,

* joint 4 follows from the distance |SW|, which depends on nothing else,
* joints 2 and 3 aim the vector SW, and
* joints 5, 6 and 7 are a spherical wrist,

each with two solutions in general: a branch is a triple of signs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.errors import ArmClassError
from tcs.kernel.arrays import Chain, FloatArray, IntArray

MEETING_TOLERANCE = 1e-9
"""Axes that pass each other closer than this [m] meet. Lowering puts the common origins of
meeting axes at one point, so only rounding is left, while the least offset built into a real arm
is millimetres."""


PARALLEL_TOLERANCE = 1e-6
"""Sine of the angle between two axes below which they count as one: built arms have 90 degrees, or
some tens of degrees; figures in a URDF carry six digits or more."""


class ArmSolver(NamedTuple):
    """One arm's constants of the closed form. L1..L7 as in `Chain`; u is SW expressed in L3."""

    R: FloatArray
    """Rotations of the chain, shape (8, 3, 3)."""
    p: FloatArray
    """Translations of the chain [m], shape (8, 3)."""
    u0: FloatArray
    """u = u0 + uc cos(q4) + us sin(q4) [m], shape (3,)."""
    uc: FloatArray
    us: FloatArray
    reach: FloatArray
    """|u|^2 = reach[0] + reach[1] cos(q4 - phase) [m^2], with phase = reach[2] [rad]."""
    elbow_cos: FloatArray
    """Least and greatest cos(q4 - phase) within the limits of joint 4, shape (2,)."""
    limit_cos: FloatArray
    """A limited joint is within its limits when cos(q - middle) >= limit_cos; shape (7,).
    -1 where the joint may turn all the way round."""
    middle_cos: FloatArray
    """cos(middle of the limits), 0 where there are none, shape (7,)."""
    middle_sin: FloatArray
    """sin(middle of the limits), 0 where there are none, shape (7,)."""
    lower: FloatArray
    """Joint limits [rad], shape (7,), infinite where the joint is continuous."""
    upper: FloatArray
    branches: IntArray
    """Signs of sin(q4 - phase), of the aim and of the wrist that can occur within the limits,
    shape (branches, 3)."""


def arm_solver(chain: Chain) -> ArmSolver:
    """Return the closed-form constants of `chain`.

    Raises:
        ArmClassError: If the arm is outside the class; the message says which axes fail to meet.
    """
    _require_meeting("2 and 3", chain.p[2])
    _require_meeting("5 and 6", chain.p[5])
    _require_meeting("6 and 7", chain.p[6])
    _require_crossing("2 and 3", chain.R[2])
    _require_crossing("5 and 6", chain.R[5])
    _require_crossing("6 and 7", chain.R[6])
    w = chain.p[4]
    R3 = chain.R[3]
    u0 = chain.p[3] + R3[:, 2] * w[2]
    uc = R3[:, 0] * w[0] + R3[:, 1] * w[1]
    us = -R3[:, 0] * w[1] + R3[:, 1] * w[0]
    # uc and us are orthogonal and equally long, so |u|^2 is one cosine of q4.
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
        R=np.array(chain.R, order="C"),
        p=np.array(chain.p, order="C"),
        u0=u0,
        uc=uc,
        us=us,
        reach=np.array([u0 @ u0 + uc @ uc, amplitude, phase]),
        elbow_cos=_cos_range(lower[3] - phase, upper[3] - phase, bool(limited[3])),
        limit_cos=np.where(limited, np.cos(half), -1.0),
        middle_cos=np.where(limited, np.cos(middle), 0.0),
        middle_sin=np.where(limited, np.sin(middle), 0.0),
        lower=np.array(lower, dtype=np.float64),
        upper=np.array(upper, dtype=np.float64),
        branches=np.array(branches, dtype=np.int64),
    )


def _require_meeting(axes: str, offset: FloatArray) -> None:
    """Raise unless the origins of two neighbouring joints coincide."""
    distance = float(np.linalg.norm(offset))
    if distance > MEETING_TOLERANCE:
        raise ArmClassError(
            f"the arm is outside the closed-form class: axes {axes} pass each other "
            f"{distance:.4f} m apart. The class needs axes 2 and 3 to meet, and 5, 6 and 7."
        )


def _require_crossing(axes: str, R: FloatArray) -> None:
    """Raise if two neighbouring axes that meet are one and the same line."""
    sine = float(np.hypot(R[0, 2], R[1, 2]))
    if sine < PARALLEL_TOLERANCE:
        raise ArmClassError(
            f"the arm is outside the closed-form class: axes {axes} are parallel. The class needs "
            "axes 2 and 3 to cross, and 5, 6 and 7."
        )


def _signs_within(lower: float, upper: float, limited: bool) -> list[int]:
    """Return the signs that sin takes on [lower, upper]."""
    if not limited:
        return [1, -1]
    # sin is >= 0 on [2k pi, (2k + 1) pi]: does any such interval meet [lower, upper]?
    first = np.floor(lower / np.pi)
    halves = {int(k) % 2 for k in np.arange(first, np.floor(upper / np.pi) + 1)}
    return [sign for sign, half in ((1, 0), (-1, 1)) if half in halves]


def _cos_range(lower: float, upper: float, limited: bool) -> FloatArray:
    """Return the least and the greatest cosine on [lower, upper]."""
    if not limited:
        return np.array([-1.0, 1.0])
    ends = np.cos([lower, upper])
    least = -1.0 if np.floor((upper - np.pi) / (2 * np.pi)) >= (lower - np.pi) / (2 * np.pi) else 0
    most = 1.0 if np.floor(upper / (2 * np.pi)) >= lower / (2 * np.pi) else 0
    return np.array([least or ends.min(), most or ends.max()])
