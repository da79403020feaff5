"""A slave arm that follows a hand at a master by resolved-rate control, one step after another.

It keeps its joint limits and joint speeds, and holds still rather than touch itself or the room.
The hand sees the arm: it waits for it, and heads elsewhere when it does not come.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.contacts import (
    NO_CONTACT,
    Workspace,
    arm_contact,
    gripper_body_contact,
    gripper_room_contact,
)
from tcs.kernel.measure import jacobian
from tcs.kernel.postures import HERE, tool_pose
from tcs.kernel.problem import Problem
from tcs.kernel.stand import room_in_arm_base, stand
from tcs.kernel.views import borrowed


class Control(NamedTuple):
    """How the slave is controlled."""

    period: float
    """Between commands [s]."""
    gain: float
    """Speed of the tool per distance to the command [1/s]."""
    speed: float
    """Most speed asked of the tool [m/s]."""
    turn_speed: float
    """Most speed of turning asked of it [rad/s]."""
    lever: float
    """What a radian of turning counts beside a metre [m]: small values give way on orientation
    first, as the slave of the ITCM thesis does, Appendix E."""
    damping: float
    """Damping of the least squares [m]."""
    centring: float
    """Speed towards the middle of the joint limits, in what freedom is left [1/s]."""
    joint_speed: FloatArray
    """Most speed of each joint [rad/s], shape (7,)."""


class Hand(NamedTuple):
    """What the hand at the master does, as the tool is told of it, in the base B."""

    targets: FloatArray
    """Places it heads for one after the other: x, y [m], heading [rad], shape (n, 3)."""
    height: float
    """Of the tool [m]."""
    R_ET: FloatArray
    """Orientation of the tool in the level frame that has the hand's heading, shape (3, 3)."""
    speed: float
    """[m/s]."""
    turn_speed: float
    """[rad/s]."""
    lead: float
    """How far ahead of the tool it goes before it waits [m]."""
    patience: float
    """How long it waits before it heads elsewhere [s]."""


@jit
def follow(
    owned_problem: Problem,
    owned_work: Workspace,
    owned_control: Control,
    owned_hand: Hand,
    start: FloatArray,
    joints: FloatArray,
    commands: FloatArray,
    held: BoolArray,
) -> None:
    """Fill what the hand commands and how the arm follows, sample by sample.

    The problem has one torso level, one place of the base and one goal, which is overwritten.

    Args:
        owned_problem: Robot and room.
        owned_work: Scratch.
        owned_control: How the slave is controlled.
        owned_hand: What the hand does; it starts where the tool is.
        start: Joint angles before the first sample, collision-free [rad], shape (7,).
        joints: Filled [rad], shape (n, 7).
        commands: Filled with x, y [m] and heading [rad] in B, shape (n, 3).
        held: Filled, whether the arm would have touched something on its way to the command,
            shape (n,).
    """
    problem, work = borrowed(owned_problem), borrowed(owned_work)
    control, hand = borrowed(owned_control), borrowed(owned_hand)
    stand(problem, work, HERE)
    room_in_arm_base(problem, work, HERE)
    R_BA, p_BA = problem.base_R[0], problem.base_p[0]
    q, following, rate = start.copy(), np.empty(7), np.empty(7)
    J, twist = np.empty((6, 7)), np.empty(6)
    R_AC, p_AC, p_BT = np.empty((3, 3)), np.empty(3), np.empty(3)
    place, target, waited = np.empty(3), 0, 0.0
    for i in range(len(joints)):
        tool_pose(
            problem.chain_R, problem.chain_p, q, work.link_R, work.link_p, work.R_AG, work.p_AG
        )
        for r in range(3):
            p_BT[r] = p_BA[r]
            for k in range(3):
                p_BT[r] += R_BA[r, k] * work.p_AG[k]
        if i == 0:
            place[0], place[1], place[2] = p_BT[0], p_BT[1], hand.targets[0, 2]
        behind = np.hypot(place[0] - p_BT[0], place[1] - p_BT[1])
        waited = waited + control.period if behind > hand.lead else 0.0
        if waited > hand.patience:
            target, waited = target + 1, 0.0
            # Back to the tool, whence it is led on.
            place[0], place[1] = p_BT[0], p_BT[1]
        if waited == 0.0:
            target += move_hand(hand, control.period, target % len(hand.targets), place)
        commands[i] = place
        command_in_arm_base(hand, R_BA, p_BA, place, R_AC, p_AC)
        jacobian(problem.chain_R, problem.chain_p, q, J)
        wanted_twist(control, R_AC, p_AC, work.R_AG, work.p_AG, twist)
        held[i] = True
        for attempt in range(2):
            joint_rates(problem, control, q, J, twist, rate)
            for k in range(7):
                following[k] = q[k] + control.period * rate[k]
            if is_free(problem, work, following):
                q[:] = following
                held[i] = attempt > 0
                break
            # What is blocked may clear while the arm centres itself about its tool.
            twist[:] = 0.0
        joints[i] = q


@inner
def move_hand(hand: Hand, period: float, target: int, place: FloatArray) -> int:
    """Move the hand towards a target for a period; return 1 when it gets there, else 0."""
    dx, dy = hand.targets[target, 0] - place[0], hand.targets[target, 1] - place[1]
    turn = hand.targets[target, 2] - place[2]
    seconds = max(np.hypot(dx, dy) / hand.speed, abs(turn) / hand.turn_speed)
    share = 1.0 if seconds <= period else period / seconds
    place[0] += share * dx
    place[1] += share * dy
    place[2] += share * turn
    return 1 if share == 1.0 else 0


@inner
def command_in_arm_base(
    hand: Hand,
    R_BA: FloatArray,
    p_BA: FloatArray,
    place: FloatArray,
    R_AC: FloatArray,
    p_AC: FloatArray,
) -> None:
    """Fill the commanded tool pose in the arm base A, shapes (3, 3) and (3,)."""
    c, s = np.cos(place[2]), np.sin(place[2])
    x, y, z = place[0] - p_BA[0], place[1] - p_BA[1], hand.height - p_BA[2]
    for r in range(3):
        p_AC[r] = R_BA[0, r] * x + R_BA[1, r] * y + R_BA[2, r] * z
        for k in range(3):
            first = c * hand.R_ET[0, k] - s * hand.R_ET[1, k]
            second = s * hand.R_ET[0, k] + c * hand.R_ET[1, k]
            R_AC[r, k] = R_BA[0, r] * first + R_BA[1, r] * second + R_BA[2, r] * hand.R_ET[2, k]


@inner
def wanted_twist(
    control: Control,
    R_AC: FloatArray,
    p_AC: FloatArray,
    R_AT: FloatArray,
    p_AT: FloatArray,
    twist: FloatArray,
) -> None:
    """Fill the twist that takes the tool to its command, [w; v] in A, shape (6,)."""
    # The axis of R_AC R_AT^T, from its antisymmetric part.
    turn = np.zeros((3, 3))
    for r in range(3):
        for c in range(3):
            for k in range(3):
                turn[r, c] += R_AC[r, k] * R_AT[c, k]
    twist[0] = 0.5 * (turn[2, 1] - turn[1, 2])
    twist[1] = 0.5 * (turn[0, 2] - turn[2, 0])
    twist[2] = 0.5 * (turn[1, 0] - turn[0, 1])
    sine = np.sqrt(twist[0] ** 2 + twist[1] ** 2 + twist[2] ** 2)
    angle = np.arctan2(sine, 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0))
    distance = 0.0
    for k in range(3):
        twist[3 + k] = p_AC[k] - p_AT[k]
        distance += twist[3 + k] ** 2
    distance = np.sqrt(distance)
    for k in range(3):
        if sine > 1e-12:
            twist[k] *= min(control.gain * angle, control.turn_speed) / sine
        if distance > 1e-12:
            twist[3 + k] *= min(control.gain * distance, control.speed) / distance


@inner
def joint_rates(
    problem: Problem,
    control: Control,
    q: FloatArray,
    J: FloatArray,
    twist: FloatArray,
    rate: FloatArray,
) -> None:
    """Fill joint speeds that realise a twist by damped least squares, within limits and speeds.

    A joint that would pass its limit is taken to the limit, and the others make up for it.

    Args:
        problem: Its joint limits count.
        control: How the slave is controlled.
        q: Joint angles [rad], shape (7,).
        J: Jacobian of the tool, rows [angular; linear], shape (6, 7).
        twist: [w; v], shape (6,).
        rate: Filled [rad/s], shape (7,).
    """
    lower, upper = problem.arm.lower, problem.arm.upper
    fixed = np.zeros(7, np.bool_)
    rate[:] = 0.0
    for _ in range(7):
        G, b, pull = np.zeros((6, 6)), np.empty(6), np.zeros(7)
        for k in range(7):
            if not fixed[k] and np.isfinite(lower[k]) and np.isfinite(upper[k]):
                pull[k] = control.centring * (0.5 * (lower[k] + upper[k]) - q[k])
        for r in range(6):
            scale = control.lever if r < 3 else 1.0
            b[r] = scale * twist[r]
            for k in range(7):
                # Fixed joints have done their part; free ones have been pulled on.
                b[r] -= scale * J[r, k] * (rate[k] if fixed[k] else pull[k])
            for c in range(6):
                other = control.lever if c < 3 else 1.0
                for k in range(7):
                    if not fixed[k]:
                        G[r, c] += scale * other * J[r, k] * J[c, k]
            G[r, r] += control.damping * control.damping
        y = np.linalg.solve(G, b)
        for k in range(7):
            if not fixed[k]:
                rate[k] = pull[k]
                for r in range(6):
                    rate[k] += (control.lever if r < 3 else 1.0) * J[r, k] * y[r]
        passing = False
        for k in range(7):
            after = q[k] + control.period * rate[k]
            if not fixed[k] and (after < lower[k] or after > upper[k]):
                bound = lower[k] if after < lower[k] else upper[k]
                rate[k] = (bound - q[k]) / control.period
                fixed[k], passing = True, True
        if not passing:
            break
    # Slower as a whole, so that the tool keeps its direction.
    slower = 1.0
    for k in range(7):
        if abs(rate[k]) > control.joint_speed[k]:
            slower = min(slower, control.joint_speed[k] / abs(rate[k]))
    for k in range(7):
        # Rounding must not carry a joint past its limit.
        after = min(max(q[k] + slower * control.period * rate[k], lower[k]), upper[k])
        rate[k] = (after - q[k]) / control.period


@jit
def is_free(problem: Problem, work: Workspace, q: FloatArray) -> bool:
    """Return whether the arm at joint angles q touches nothing; base and room are placed."""
    link_R, link_p = work.link_R, work.link_p
    tool_pose(problem.chain_R, problem.chain_p, q, link_R, link_p, work.R_AG, work.p_AG)
    R, p = problem.base_R[0], problem.base_p[0]
    goal_R, goal_p = problem.goal_R[0, 0], problem.goal_p[0, 0]
    for r in range(3):
        goal_p[r] = p[r]
        for m in range(3):
            goal_p[r] += R[r, m] * work.p_AG[m]
        for c in range(3):
            goal_R[r, c] = 0.0
            for m in range(3):
                goal_R[r, c] += R[r, m] * work.R_AG[m, c]
    if gripper_room_contact(problem, work, HERE, HERE) != NO_CONTACT:
        return False
    body_A = problem.body_A[0]
    if gripper_body_contact(problem, work, body_A) != NO_CONTACT:
        return False
    return arm_contact(problem, work, body_A, q) == NO_CONTACT
