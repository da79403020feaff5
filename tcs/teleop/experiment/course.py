"""The experiment's line: it cannot be followed to its end without null-space motion.

A straight line from the front towards the back of the workspace on which joint 4 or 6 meets a limit
after three quarters of the way. Nothing is typed in: the line is searched for, the first one that
meets every condition of `find_course` is taken, and the same seed finds the same line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.capability import Reach
from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import JOINTS, Arm
from tcs.teleop.control.joint_groups import group_motion
from tcs.teleop.control.resolved_rate import pose_error, resolved_rates, rotated
from tcs.teleop.control.settings import Settings
from tcs.teleop.line import Line

BLOCKED_AFTER = 0.75
"""Share of the line after which a joint is at its limit (paper: three quarters)."""
BLOCKING = (3, 5)
"""Joints that may block it, counted from 0: 4 and 6."""
_SHORTEST, _LONGEST = 0.4, 0.9
"""Way until the limit [m]: shorter ones are no way to speak of, longer ones few arms have."""
_OFF_AXIS = 0.2
"""The line keeps so far from the vertical axis of the arm's base [m]: there its body stands."""
_AHEAD = 0.45
"""A start lies at least so far ahead of the arm's base, as a fraction of the arm's reach."""
_HEADING = math.radians(25.0)
"""The line goes straight back, give or take so much."""
_TURNS = np.radians(np.arange(10.0, 151.0, 10.0))
"""Turns of joint 1 that are tried."""
_SOLVING = 3
"""Least number of neighbouring turns that must open the way: no operator is exact to a degree."""
_DETOURS = 60
"""Hand motions that are tried; one of them at least must open the way."""
_FARTHEST = 0.2
"""Way of the longest of them [m]."""
_TURN_PER_METRE = 5.0
"""How far the hand turns on its way [rad/m]."""
_AIM = 0.1
"""How far ahead on the line the tool aims once it is off it [m]."""
_STEP = 0.004
"""Way from one posture to the next [m]: a limit is found to that."""
_TURN_STEP = 0.02
"""The same for turns [rad]."""
_STILL = 1e-9
"""A joint that moves less than this in a step keeps still [rad]."""
_MARGIN = 0.85
"""Start postures keep within this share of the joints' ranges about their middles."""
_TRIED = 100_000
"""Start postures after which the search gives up: a minute or two."""


@dataclass(frozen=True, eq=False)
class Course:
    """A line, and how the arm stands at its start."""

    line: Line
    """In the robot's base [m]."""
    joints: FloatArray
    """Start posture [rad], shape (7,)."""
    blocking: int
    """The joint that ends the straight way, counted from 0."""
    turns: tuple[float, ...]
    """Turns of joint 1 after which the way is open [rad]."""

    def __post_init__(self) -> None:
        """Make the array read-only."""
        self.joints.flags.writeable = False


def find_course(arm: Arm, seed: int = 0, settings: Settings | None = None) -> Course:
    """Return the first line that is found to fit.

    - The start lies ahead of the arm's base; the line is level and leads straight back, within
      25 deg; an arm that stands on a base of its own, without a torso, comes behind it.
    - Without hand or noise, end-effector control comes three quarters of the way, 0.4 m at least,
      before joint 4 or 6 is at its limit.
    - Turning joint group 1 there opens the rest of the way, for three neighbouring turns at least.
    - So does one hand motion at least: the end can be reached with either controller.
    - Along the straight part, the middle one of those turns and the rest of the way, the arm
      touches neither the robot nor the floor.

    Args:
        arm: The arm.
        seed: Of the start postures.
        settings: What counts as singular.

    Raises:
        TcsError: If no line is found.
    """
    walk = _Walk(arm, settings or Settings())
    rng = np.random.default_rng(seed)
    reach = Reach(arm.robot, torso_height=arm.torso_height)
    lower = np.where(arm.bounded, arm.lower, -math.pi)
    upper = np.where(arm.bounded, arm.upper, math.pi)
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower) * _MARGIN
    base = arm.frames[0, :3, 3]
    for _ in range(_TRIED):
        joints = middle + half * rng.uniform(-1.0, 1.0, JOINTS)
        heading = math.pi + rng.uniform(-_HEADING, _HEADING)
        start = arm.link_poses(joints)[JOINTS, :3, 3]
        ahead = start - base
        way = np.array([math.cos(heading), math.sin(heading), 0.0])
        beside = abs(ahead[0] * way[1] - ahead[1] * way[0])
        if ahead[0] < _AHEAD * reach.length or beside < _OFF_AXIS:
            continue
        found = _course(walk, reach, joints, way, rng)
        if found is not None:
            return found
    raise TcsError(
        f"no line for '{arm.name}' on which joint 4 or 6 meets a limit after three quarters of the "
        f"way and group 1 opens the rest: {_TRIED:,} start postures were tried with seed {seed}. "
        "Try another seed."
    )


def _course(
    walk: _Walk, reach: Reach, joints: FloatArray, way: FloatArray, rng: np.random.Generator
) -> Course | None:
    """Return the line from a start that fits, if there is one."""
    arm = walk.arm
    start = arm.link_poses(joints)[JOINTS, :3, 3]
    ahead = Line(_triple(start), _triple(start + _LONGEST * way))
    straight, joint = walk.follow(joints, ahead)
    blocked = straight[-1]
    done = float(ahead.fraction_at(arm.link_poses(blocked)[JOINTS, :3, 3])) * ahead.length
    if joint not in BLOCKING or done < _SHORTEST:
        return None
    line = Line(_triple(start), _triple(start + done / BLOCKED_AFTER * way))
    if arm.robot.torso_joint is None and line.end[0] > arm.frames[0, 0, 3]:
        return None
    turns = walk.opening_turns(blocked, line)
    if not turns:
        return None
    turned = walk.turn(blocked, turns[len(turns) // 2])
    if not len(turned):
        return None
    rest, joint_after = walk.follow(turned[-1], line)
    if (
        joint_after >= 0
        or not reach.free(np.concatenate([straight, turned, rest]), reach.level).all()
    ):
        return None
    if not walk.has_detour(blocked, line, rng):
        return None
    return Course(line, joints, joint, turns)


def _triple(point: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z


@dataclass(frozen=True, eq=False)
class _Walk:
    """An arm that moves without inertia, hand or noise: where it comes to, and what stops it."""

    arm: Arm
    settings: Settings

    def follow(self, joints: FloatArray, line: Line) -> tuple[FloatArray, int]:
        """Go along a line, or back to it, the tool's orientation held.

        Returns:
            The postures on the way, shape (n, 7), and the joint at whose limit it ends: -1 for
            none, the end was reached; `JOINTS` where the arm is singular.
        """
        R = self.arm.kinematics(joints).R
        end = np.asarray(line.end)
        trail = [joints]
        # From off the line the way is longer, by twice the way off it at most.
        for _ in range(int(2.0 * line.length / _STEP)):
            p = self.arm.link_poses(joints)[JOINTS, :3, 3]
            if np.linalg.norm(end - p) <= _STEP:
                return np.array(trail), -1
            aim = line.at(min(1.0, float(line.fraction_at(p)) + _AIM / line.length)) - p
            ahead = p + aim * min(1.0, _STEP / float(np.linalg.norm(aim)))
            joints, joint = self._move(joints, R, ahead)
            if joint >= 0:
                return np.array(trail), joint
            trail.append(joints)
        return np.array(trail), JOINTS

    def turn(self, joints: FloatArray, angle: float) -> FloatArray:
        """Turn joint group 1, the tool's place held.

        Returns:
            The postures on the way, shape (n, 7); none where a limit ends it before.
        """
        p = self.arm.link_poses(joints)[JOINTS, :3, 3]
        steps = math.ceil(abs(angle) / _TURN_STEP)
        trail = []
        for _ in range(steps):
            now = self.arm.kinematics(joints)
            group = self.settings.groups[0]
            motion = group_motion(now.jacobian[3:], group, angle / steps, p - now.p)
            if self._ends(joints, motion.rates) >= 0:
                return np.empty((0, JOINTS))
            joints = joints + motion.rates
            trail.append(joints)
        return np.array(trail)

    def opening_turns(self, blocked: FloatArray, line: Line) -> tuple[float, ...]:
        """Return the turns of joint 1 that open the way: neighbours, the most there are."""
        best: tuple[float, ...] = ()
        for sign in (-1.0, 1.0):
            run: tuple[float, ...] = ()
            joints = blocked
            for turn in _TURNS:
                trail = self.turn(joints, sign * float(_TURNS[0]))
                if not len(trail):
                    break
                joints = trail[-1]
                opens = self.follow(joints, line)[1] < 0
                run = (*run, sign * float(turn)) if opens else ()
                best = max(best, run, key=len)
        return best if len(best) >= _SOLVING else ()

    def has_detour(self, blocked: FloatArray, line: Line, rng: np.random.Generator) -> bool:
        """Return whether some motion of the hand opens the way."""
        for _ in range(_DETOURS):
            turn, way = rng.standard_normal((2, 3))
            length = rng.uniform(0.0, _FARTHEST)
            way *= length / np.linalg.norm(way)
            turn *= length * _TURN_PER_METRE / np.linalg.norm(turn)
            joints = self._shift(blocked, turn, way)
            if joints is not None and self.follow(joints, line)[1] < 0:
                return True
        return False

    def _shift(self, joints: FloatArray, turn: FloatArray, way: FloatArray) -> FloatArray | None:
        """Move the hand straight; None where a limit ends it."""
        start = self.arm.kinematics(joints)
        steps = max(1, math.ceil(np.linalg.norm(way) / _STEP))
        for i in range(1, steps + 1):
            R = rotated(start.R, turn, i / steps)
            joints, joint = self._move(joints, R, start.p + way * (i / steps))
            if joint >= 0:
                return None
        return joints

    def _move(self, joints: FloatArray, R: FloatArray, p: FloatArray) -> tuple[FloatArray, int]:
        """Bring the tool to a pose close by; where that is not possible, stay and say why."""
        now = self.arm.kinematics(joints)
        error = pose_error(R, p, now.R, now.p)
        length = self.settings.length
        change, smallest = resolved_rates(now.jacobian, error, length=length)
        if smallest < self.settings.singular:
            return joints, JOINTS
        joint = self._ends(joints, change)
        return (joints, joint) if joint >= 0 else (joints + change, -1)

    def _ends(self, joints: FloatArray, change: FloatArray) -> int:
        """Return a joint that would go beyond its limit, -1 if none would."""
        after = joints + change
        # A joint that keeps still but for rounding does not run into its limit.
        beyond = ((after > self.arm.upper) & (change > _STILL)) | (
            (after < self.arm.lower) & (change < -_STILL)
        )
        return int(np.argmax(beyond)) if beyond.any() else -1
