"""The experiment's line, which cannot be followed to its end without null-space motion.

It is a straight line from the front towards the back of the workspace on which joint 4 or 6 meets a
limit after three quarters of the length. The line is found by a random search, and is the first one
that meets every condition of `find_course`; the same seed gives the same line.
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
from tcs.teleop.line import Course, Line

BLOCKED_AFTER = 0.75
"""Fraction of the line after which a joint is at its limit (paper: three quarters)."""
BLOCKING = (3, 5)
"""Joints that may block the line, counted from 0: 4 and 6."""
_SHORTEST, _LONGEST = 0.4, 0.9
"""Range of the distance to the limit [m]: shorter lines test little, and few arms reach longer
ones."""
_OFF_AXIS = 0.2
"""Least distance of the line from the vertical axis of the arm's base [m], where the body is."""
_AHEAD = 0.45
"""Least distance of the start ahead of the arm's base, as a fraction of the arm's reach."""
_HEADING = math.radians(25.0)
"""Greatest deviation of the line from the direction straight back [rad]."""
_TURNS = np.radians(np.arange(10.0, 151.0, 10.0))
"""Rotations of joint 1 to try [rad]."""
_SOLVING = 3
"""Least number of consecutive rotations that must unblock the line, as operators are inaccurate."""
_DETOURS = 60
"""Number of hand motions to try, of which one at least must unblock the line."""
_FARTHEST = 0.2
"""Greatest distance of a hand motion [m]."""
_TURN_PER_METRE = 5.0
"""Rotation of the hand per distance in a hand motion [rad/m]."""
_AIM = 0.1
"""Distance ahead on the line at which the tool aims when it is beside the line [m]."""
_STEP = 0.004
"""Distance from one posture to the next [m], the resolution with which a limit is found."""
_TURN_STEP = 0.02
"""Rotation of joint 1 from one posture to the next [rad]."""
_STILL = 1e-9
"""Motion in one step below which a joint is at rest [rad]."""
_MARGIN = 0.85
"""Fraction of the joint ranges, about their middles, from which start postures are drawn."""
_TRIED = 100_000
"""Greatest number of start postures, a minute or two of search."""


def find_course(arm: Arm, seed: int = 0, settings: Settings | None = None) -> Course:
    """Return the first line found that meets these conditions.

    - The start is ahead of the arm's base; the line is level and leads straight back, within 25
      deg; for a robot without a torso joint it ends behind the arm's base.
    - Without hand motion and noise, end-effector control follows three quarters of the line, 0.4 m
      at least, until joint 4 or 6 is at its limit.
    - Motion of joint group 1 there unblocks the rest of the line, for three consecutive rotations
      at least.
    - So does one hand motion at least: the end can be reached with either controller.
    - Along the first part, the middle one of those rotations and the rest of the line, the arm is
      free of contact with the robot and the floor.

    Args:
        arm: The arm.
        seed: Seed of the start postures.
        settings: Settings of the controller; None for the defaults.

    Raises:
        TcsError: If no line is found.
    """
    kinematic_arm = _KinematicArm(arm, settings or Settings())
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
        direction = np.array([math.cos(heading), math.sin(heading), 0.0])
        beside = abs(ahead[0] * direction[1] - ahead[1] * direction[0])
        if ahead[0] < _AHEAD * reach.length or beside < _OFF_AXIS:
            continue
        found = _course(kinematic_arm, reach, joints, direction, rng)
        if found is not None:
            return found
    raise TcsError(
        f"no line for '{arm.name}' on which joint 4 or 6 meets a limit after three quarters of the "
        f"length and group 1 unblocks the rest: {_TRIED:,} start postures were tried with seed "
        f"{seed}. Try another seed."
    )


def _course(
    kinematic_arm: _KinematicArm,
    reach: Reach,
    joints: FloatArray,
    direction: FloatArray,
    rng: np.random.Generator,
) -> Course | None:
    """Return the line from a start posture in a direction, None if it fails a condition."""
    arm = kinematic_arm.arm
    start = arm.link_poses(joints)[JOINTS, :3, 3]
    ahead = Line(_triple(start), _triple(start + _LONGEST * direction))
    straight, joint = kinematic_arm.follow(joints, ahead)
    blocked = straight[-1]
    done = float(ahead.fraction_at(arm.link_poses(blocked)[JOINTS, :3, 3])) * ahead.length
    if joint not in BLOCKING or done < _SHORTEST:
        return None
    line = Line(_triple(start), _triple(start + done / BLOCKED_AFTER * direction))
    if arm.robot.torso_joint is None and line.end[0] > arm.frames[0, 0, 3]:
        return None
    turns = kinematic_arm.opening_turns(blocked, line)
    if not turns:
        return None
    turned = kinematic_arm.turn(blocked, turns[len(turns) // 2])
    if not len(turned):
        return None
    rest, joint_after = kinematic_arm.follow(turned[-1], line)
    if (
        joint_after >= 0
        or not reach.free(np.concatenate([straight, turned, rest]), reach.level).all()
    ):
        return None
    if not kinematic_arm.has_detour(blocked, line, rng):
        return None
    return Course(line, joints, joint, turns)


def _triple(point: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z


@dataclass(frozen=True, eq=False)
class _KinematicArm:
    """Kinematic simulation of an arm, without dynamics and noise: its path, and what stops it."""

    arm: Arm
    settings: Settings

    def follow(self, joints: FloatArray, line: Line) -> tuple[FloatArray, int]:
        """Move the tool to the line and along it, the tool's orientation held.

        Returns:
            Postures along the path [rad], shape (n, 7), and the joint at whose limit it ends: -1 if
            the end is reached, `JOINTS` if the arm is singular.
        """
        R = self.arm.kinematics(joints).R
        end = np.asarray(line.end)
        trail = [joints]
        # From a start beside the line the path is longer than the line.
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
        """Rotate joint 1 by an angle [rad] with its group, the tool's position held.

        Returns:
            Postures along the path [rad], shape (n, 7); empty if a limit ends the motion.
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
        """Return the longest sequence of neighbouring rotations that unblock the line [rad]."""
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
        """Return whether some hand motion unblocks the line."""
        for _ in range(_DETOURS):
            rotation, translation = rng.standard_normal((2, 3))
            length = rng.uniform(0.0, _FARTHEST)
            translation *= length / np.linalg.norm(translation)
            rotation *= length * _TURN_PER_METRE / np.linalg.norm(rotation)
            joints = self._shift(blocked, rotation, translation)
            if joints is not None and self.follow(joints, line)[1] < 0:
                return True
        return False

    def _shift(
        self, joints: FloatArray, rotation: FloatArray, translation: FloatArray
    ) -> FloatArray | None:
        """Return the posture after a hand motion, None if a limit ends the motion.

        Args:
            joints: Start posture [rad], shape (7,).
            rotation: Rotation vector of the motion [rad], shape (3,).
            translation: Translation of the motion [m], shape (3,).
        """
        start = self.arm.kinematics(joints)
        steps = max(1, math.ceil(np.linalg.norm(translation) / _STEP))
        for i in range(1, steps + 1):
            R = rotated(start.R, rotation, i / steps)
            joints, joint = self._move(joints, R, start.p + translation * (i / steps))
            if joint >= 0:
                return None
        return joints

    def _move(self, joints: FloatArray, R: FloatArray, p: FloatArray) -> tuple[FloatArray, int]:
        """Return the posture after one step to a nearby pose, and the joint that blocks it.

        The joint is -1 if none does, and `JOINTS` if the arm is singular; if blocked, the posture
        is the given one.
        """
        now = self.arm.kinematics(joints)
        error = pose_error(R, p, now.R, now.p)
        length = self.settings.length
        change, smallest = resolved_rates(now.jacobian, error, length=length)
        if smallest < self.settings.singular:
            return joints, JOINTS
        joint = self._ends(joints, change)
        return (joints, joint) if joint >= 0 else (joints + change, -1)

    def _ends(self, joints: FloatArray, change: FloatArray) -> int:
        """Return the first joint that would exceed its limit, -1 if none would."""
        after = joints + change
        # A joint that moves only by rounding does not exceed its limit.
        beyond = ((after > self.arm.upper) & (change > _STILL)) | (
            (after < self.arm.lower) & (change < -_STILL)
        )
        return int(np.argmax(beyond)) if beyond.any() else -1
