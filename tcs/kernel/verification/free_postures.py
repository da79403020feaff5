"""Contacts of given postures, by the kernel's shapes."""

from __future__ import annotations

from tcs.kernel.arrays import FloatArray
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import jit
from tcs.kernel.contacts import (
    BASE_FIXED,
    NO_CONTACT,
    arm_contact,
    base_contact,
    gripper_body_contact,
    gripper_environment_contact,
    upper_contact,
)
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace


@jit
def base_is_free(owned_problem: Problem, owned_work: Workspace, owned_row: Rows) -> bool:
    """Return whether the robot at rest touches nothing at a configuration."""
    problem, work, row = unowned(owned_problem), unowned(owned_work), unowned(owned_row)
    torso = row.torso[0]
    place_base(problem, work, row, 0)
    return (
        base_contact(problem, work, BASE_FIXED, BASE_FIXED) == NO_CONTACT
        and upper_contact(problem, work, torso) == NO_CONTACT
    )


@jit
def posture_contact(
    owned_problem: Problem, owned_work: Workspace, owned_row: Rows, goal: int, q: FloatArray
) -> int:
    """Return a contact of arm or gripper at joint angles q that hold the tool at a goal."""
    problem, work, row = unowned(owned_problem), unowned(owned_work), unowned(owned_row)
    state, torso = row.state[0], row.torso[0]
    place_base(problem, work, row, 0)
    code = gripper_environment_contact(problem, work, state, goal)
    if code != NO_CONTACT:
        return code
    goal_in_arm_base(problem, work, state, torso, goal)
    body_A = problem.body_A[torso]
    code = gripper_body_contact(problem, work, body_A)
    if code != NO_CONTACT:
        return code
    environment_in_arm_base(problem, work, torso)
    work.last[0] = -1
    return arm_contact(problem, work, body_A, q)
