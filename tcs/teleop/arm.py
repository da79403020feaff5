"""The teleoperated arm: chain, joint limits, forward kinematics and Jacobian."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tcs.errors import GridError, TcsError
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.kinematics import jacobian, tool_pose
from tcs.model.robots import RobotFile, load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, arm_chain

JOINTS = 7
DEFAULT_VELOCITY = 1.0
"""Velocity limit of a joint whose URDF gives none [rad/s]: below that of any arm included."""


class Kinematics(NamedTuple):
    """Pose of the tool T in the robot's base B, and its Jacobian."""

    R: FloatArray
    """R_BT, shape (3, 3)."""
    p: FloatArray
    """p_BoTo_B [m], shape (3,)."""
    jacobian: FloatArray
    """Jacobian of the spatial velocity V_BT in B, shape (6, 7), rows angular then linear [rad/rad;
    m/rad]."""


@dataclass(frozen=True, eq=False)
class Arm:
    """The scored arm of a robot whose base and torso are fixed.

    Attributes:
        robot: The robot.
        lower: Lower limits in force [rad], shape (7,); -inf for a continuous joint.
        upper: Upper limits in force [rad], shape (7,); +inf for a continuous joint.
        velocity: Greatest joint rates [rad/s], shape (7,).
        torso_height: Height of the torso joint [m]; 0 for a robot without one.
        frames: Transforms between neighbouring link frames at zero joint positions, shape
            (8, 4, 4): X_BL1, six X_Li-1,Li, X_L7T. Link i rotates about the z axis of Li.
    """

    robot: RobotFile = field(repr=False)
    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    torso_height: float
    frames: FloatArray = field(repr=False)
    _chain: tuple[FloatArray, FloatArray] = field(init=False, repr=False)
    """Rotations and translations of `frames`, for the kernel."""

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for array in (self.lower, self.upper, self.velocity, self.frames):
            array.flags.writeable = False
        # Writable copies: numba compiles anew for read-only arrays, which are another type.
        R, p = self.frames[:, :3, :3], self.frames[:, :3, 3]
        chain = np.array(R, order="C"), np.array(p, order="C")
        object.__setattr__(self, "_chain", chain)

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.robot.name

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the seven joints, from the base outward."""
        return self.robot.arm_joints

    @property
    def bounded(self) -> BoolArray:
        """Which joints have limits, shape (7,)."""
        return np.isfinite(self.lower) & np.isfinite(self.upper)

    def link_poses(self, joints: FloatArray) -> FloatArray:
        """Return X_BL1 .. X_BL7 and X_BT as matrices, shape (8, 4, 4).

        Args:
            joints: Joint positions [rad], shape (7,).
        """
        link_R, link_p = np.empty((JOINTS + 1, 3, 3)), np.empty((JOINTS + 1, 3))
        poses = np.zeros((JOINTS + 1, 4, 4))
        R, p = np.empty((3, 3)), np.empty(3)
        tool_pose(*self._chain, _writable(joints), link_R, link_p, R, p)
        poses[:JOINTS, :3, :3], poses[:JOINTS, :3, 3] = link_R[1:], link_p[1:]
        poses[JOINTS, :3, :3], poses[JOINTS, :3, 3] = R, p
        poses[:, 3, 3] = 1.0
        return poses

    def kinematics(self, joints: FloatArray) -> Kinematics:
        """Return the tool's pose and Jacobian.

        Args:
            joints: Joint positions [rad], shape (7,).
        """
        q = _writable(joints)
        link_R, link_p = np.empty((JOINTS + 1, 3, 3)), np.empty((JOINTS + 1, 3))
        R, p, J = np.empty((3, 3)), np.empty(3), np.empty((6, JOINTS))
        tool_pose(*self._chain, q, link_R, link_p, R, p)
        jacobian(*self._chain, q, J)
        return Kinematics(R, p, J)

    def checked(self, joints: object, where: str = "joints") -> FloatArray:
        """Return seven joint positions as a new array.

        Raises:
            TcsError: If there are not exactly seven finite numbers.
        """
        try:
            values = np.array(joints, dtype=np.float64)
        except (OverflowError, TypeError, ValueError):
            values = np.empty(0)
        if values.shape != (JOINTS,) or not np.isfinite(values).all():
            raise TcsError(
                f"{where}: must be {JOINTS} finite numbers [rad], one for each joint of "
                f"'{self.name}' from the base outward, but is {joints!r}."
            )
        return values

    def limit_violation(self, joints: FloatArray) -> str:
        """Return a message about the first joint beyond its limits, empty if there is none.

        Args:
            joints: Joint positions [rad], shape (7,).
        """
        outside = (joints < self.lower) | (joints > self.upper)
        if not outside.any():
            return ""
        i = int(np.argmax(outside))
        return (
            f"joint {i + 1} ('{self.joints[i]}') is at {joints[i]:.4f} rad, outside its limits "
            f"{self.lower[i]:.4f} to {self.upper[i]:.4f}"
        )

    def random_joints(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Return uniformly drawn postures within the limits [rad], shape (count, 7).

        Continuous joints are drawn from a full rotation.
        """
        lower = np.where(self.bounded, self.lower, -np.pi)
        upper = np.where(self.bounded, self.upper, np.pi)
        return rng.uniform(lower, upper, size=(count, JOINTS))


def _writable(joints: FloatArray) -> FloatArray:
    """Return a writable copy: numba compiles anew for read-only arrays, which are another type."""
    return np.array(joints, dtype=np.float64)


def load_arm(robot: RobotFile | str | Path, *, torso_height: float = 0.0) -> Arm:
    """Return the scored arm of a robot, read from its Drake plant.

    Args:
        robot: The robot, its name, or the path of a robot file.
        torso_height: Height of the torso joint [m], clipped to its range.

    Raises:
        UnknownNameError: If there is no robot of that name.
        RobotError: If the robot file or its model cannot be used, or the arm does not have seven
            joints.
        TcsError: If the torso height is not finite.
    """
    if not math.isfinite(torso_height):
        raise TcsError(f"torso height: must be a finite number [m], not {torso_height}.")
    file = robot if isinstance(robot, RobotFile) else load_robot(robot)
    file.require_seven_joints("teleoperation")
    scene = Scene(SceneSpec(file, EMPTY_ENVIRONMENT))
    used = scene.set_torso(torso_height)
    scene.set_arm(np.zeros(JOINTS))
    chain, _ = arm_chain(scene)
    built = scene.built
    X_BA = built.arm_base_frame.CalcPose(scene.plant_context, built.base_frame).GetAsMatrix4()
    frames = np.zeros((JOINTS + 1, 4, 4))
    frames[:, :3, :3], frames[:, :3, 3], frames[:, 3, 3] = chain.R, chain.p, 1.0
    frames[0] = X_BA @ frames[0]
    joints = file.model().joints
    fastest = np.array([joints[name].velocity for name in file.arm_joints])
    return Arm(
        robot=file,
        lower=chain.lower.copy(),
        upper=chain.upper.copy(),
        velocity=np.where(np.isfinite(fastest), fastest, DEFAULT_VELOCITY),
        torso_height=used,
        frames=frames,
    )


def torso_height_of(robot: RobotFile, requested: float | None = None) -> float:
    """Return a torso height that the robot can have [m]; 0 for a robot without a torso joint.

    Args:
        robot: The robot.
        requested: Height of the torso joint [m]; None for the middle of its range.

    Raises:
        GridError: If the requested height is out of range.
    """
    low = high = 0.0
    if robot.torso_joint is not None:
        low, high = robot.joint_limits()[robot.torso_joint]
    height = 0.5 * (low + high) if requested is None else requested
    if not low <= height <= high:
        raise GridError(
            f"robot '{robot.name}': torso height {height:g} m is out of range; its torso goes from "
            f"{low:g} to {high:g} m."
        )
    return height
