"""Constants that solve an arm of six joints.

Three classes have a closed form; any other arm of six revolute joints is solved by `elimination`,
from the constants in `general`. In numbers of the arm's own axes, 1 to 6:

* spherical wrist: axes 1 and 2 meet, and axes 4, 5 and 6 meet in one point. With a further joint
  before the first one this is an arm of `tcs.kernel.analytic`, solved with that joint at 0.
* parallel axes: axes 2, 3 and 4 are parallel, and axes 5 and 6 meet.
* three prismatic joints, in any order with three revolute ones, of which neighbours are not
  parallel: the orientation of the goal gives the angles, and its position the rest.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from tcs.errors import ArmClassError
from tcs.kernel.analytic.solver import (
    FIRST,
    MEETING_TOLERANCE,
    ArmSolver,
    arm_solver,
    outside_solver,
)
from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.lines import PARALLEL_TOLERANCE, axis_distance
from tcs.kernel.problem import with_slides
from tcs.kernel.six_joints.general import GeneralArm, general_arm, no_general_arm


class SixJointArm(NamedTuple):
    """Constants of one arm of six joints; joints and frames as in `Chain`."""

    wrist: ArmSolver
    """The closed form of a spherical-wrist arm without joint limits; without branches for one with
    parallel axes."""
    R: FloatArray
    """Rotations of the chain, shape (8, 3, 3)."""
    p: FloatArray
    """Translations of the chain [m], L6 and L7 of an arm with parallel axes shifted to where its
    axes 5 and 6 meet, shape (8, 3); (8, 4) with prismatic joints, as in `Problem`."""
    lower: FloatArray
    """Joint limits [rad], shape (7,); infinite where continuous."""
    upper: FloatArray
    general: GeneralArm
    """Constants of an arm without a closed form; with direction 0 for one that has it."""


def six_joint_arm(chain: Chain) -> SixJointArm:
    """Return the constants of an arm of six joints.

    Args:
        chain: An arm of six joints.

    Raises:
        ArmClassError: If it has prismatic joints and no closed form, or redundant axes; the message
            says what it lacks.
    """
    lower, upper = (np.array(a, dtype=np.float64) for a in (chain.lower, chain.upper))
    if np.any(chain.slides):
        _check_sliding(chain)
        p, wrist = with_slides(chain), outside_solver(chain)
        R = np.array(chain.R, order="C")
        return SixJointArm(wrist, R, p, lower, upper, no_general_arm())
    unlimited = chain._replace(lower=np.full(7, -np.inf), upper=np.full(7, np.inf))
    p, wrist = np.array(chain.p, order="C"), outside_solver(unlimited)
    general = no_general_arm()
    try:
        solver = arm_solver(unlimited)
        if solver.free != FIRST:
            raise ArmClassError("joint 1 is not the free joint.")
        wrist = solver
    except ArmClassError:
        try:
            p = _with_wrist_at_meeting_point(chain)
        except ArmClassError as error:
            found = general_arm(chain)
            if found is None:
                raise ArmClassError(
                    f"{error} Elimination cannot solve it either: some of its axes coincide or "
                    "move the tool in the same way, so it cannot take every pose."
                ) from None
            general = found
    R = np.array(chain.R, order="C")
    return SixJointArm(wrist=wrist, R=R, p=p, lower=lower, upper=upper, general=general)


def has_spherical_wrist(arm: SixJointArm) -> bool:
    """Return whether an arm is in the spherical-wrist class, else its axes are parallel."""
    return len(arm.wrist.branches) > 0


def is_general(arm: SixJointArm) -> bool:
    """Return whether an arm has no closed form and is solved by elimination."""
    return arm.general.direction != 0


def is_sliding(arm: SixJointArm) -> bool:
    """Return whether an arm has prismatic joints."""
    return arm.p.shape[1] > 3


def _check_sliding(chain: Chain) -> None:
    """Check that an arm with prismatic joints has a closed form.

    Raises:
        ArmClassError: If it does not have three of each type, or two neighbouring axes of rotation
            are parallel.
    """
    slides = chain.slides[1:] > 0.0
    if int(slides.sum()) != 3:
        raise ArmClassError(
            f"the arm has {int(slides.sum())} prismatic joints among six. With prismatic joints, "
            "three of them and three revolute ones are supported."
        )
    R, axes = np.eye(3), []
    for i in range(7):
        R = R @ chain.R[i]
        if i and not slides[i - 1]:
            axes.append(R[:, 2])
    for first, second in itertools.pairwise(axes):
        if np.linalg.norm(np.cross(first, second)) < PARALLEL_TOLERANCE:
            raise ArmClassError(
                "two neighbouring revolute joints of the arm with prismatic joints are parallel, "
                "so that it cannot take every orientation: such arms are not supported."
            )


def _with_wrist_at_meeting_point(chain: Chain) -> FloatArray:
    """Return the translations with L6 and L7 where axes 5 and 6 of the arm meet.

    Raises:
        ArmClassError: If they do not meet, or axes 2, 3 and 4 of the arm are not parallel.
    """
    tilt = max(float(np.hypot(*chain.R[i][:2, 2])) for i in (3, 4))
    passing = axis_distance(chain.R[6], chain.p[6])
    if tilt > PARALLEL_TOLERANCE or passing is None or passing[0] > MEETING_TOLERANCE:
        angle = np.degrees(np.arcsin(min(tilt, 1.0)))
        apart = "are parallel" if passing is None else f"pass each other {passing[0]:.3g} m apart"
        raise ArmClassError(
            "the arm of six joints has no closed form. "
            "It would need axes 1 and 2 to meet, and 4, 5 and 6 in one point; or axes 2, 3 and 4 "
            f"to be parallel (they are up to {angle:.3g} degrees apart), and 5 and 6 to meet (they "
            f"{apart})."
        )
    _, on_fifth, on_sixth = passing
    p, z = np.array(chain.p, order="C"), np.array([0.0, 0.0, 1.0])
    p[5] += chain.R[5] @ z * on_fifth
    p[6] += chain.R[6] @ z * on_sixth - z * on_fifth
    p[7] -= z * on_sixth
    return p
