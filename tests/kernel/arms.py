"""Chains of real arms, read from Drake's plant of their own URDF."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from tcs.kernel.arrays import Chain
from tcs.model.robots.urdf.kinematic import kinematic_urdf
from tcs.model.scene.chain import JointAxis, link_frames

_ROBOTS = "package://example-robot-data/robots"
_PR2 = "shoulder_pan shoulder_lift upper_arm_roll elbow_flex forearm_roll wrist_flex wrist_roll"


@dataclass(frozen=True)
class Arm:
    """One arm of a robot: links at its two ends, joints in between."""

    urdf: str
    base: str
    joints: tuple[str, ...]
    tool: str


ARMS = {
    "pr2 left": Arm(
        "pr2_description/urdf/pr2.urdf",
        "torso_lift_link",
        tuple(f"l_{name}_joint" for name in _PR2.split()),
        "l_gripper_tool_frame",
    ),
    "pr2 right": Arm(
        "pr2_description/urdf/pr2.urdf",
        "torso_lift_link",
        tuple(f"r_{name}_joint" for name in _PR2.split()),
        "r_gripper_tool_frame",
    ),
    "tiago": Arm(
        "tiago_description/robots/tiago.urdf",
        "torso_lift_link",
        tuple(f"arm_{i}_joint" for i in range(1, 8)),
        "arm_tool_link",
    ),
    "panda": Arm(
        "panda_description/urdf/panda.urdf",
        "panda_link0",
        tuple(f"panda_joint{i}" for i in range(1, 8)),
        "panda_hand_tcp",
    ),
    "baxter": Arm(
        "baxter_description/urdf/baxter.urdf",
        "left_arm_mount",
        tuple(f"left_{name}" for name in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")),
        "left_gripper",
    ),
}


class DrakeArm:
    """An arm in a plant of its own, and its chain for the kernel."""

    def __init__(self, arm: Arm) -> None:
        self._plant = plant = MultibodyPlant(0.0)
        Parser(plant).AddModelsFromString(kinematic_urdf(f"{_ROBOTS}/{arm.urdf}"), "urdf")
        plant.Finalize()
        self._context = plant.CreateDefaultContext()
        self._base, self._tool = plant.GetFrameByName(arm.base), plant.GetFrameByName(arm.tool)
        self._joints = [plant.GetJointByName(name) for name in arm.joints]
        self.chain = self._chain()

    def tool_pose(self, q):
        """Return X_AT at joint angles q, rotation and position."""
        self._turn(q)
        X_AT = self._tool.CalcPose(self._context, self._base)
        return X_AT.rotation().matrix(), X_AT.translation()

    def _turn(self, q):
        for joint, angle in zip(self._joints, q, strict=True):
            joint.set_angle(self._context, angle)

    def _chain(self):
        self._turn(np.zeros(7))
        axes = []
        for joint in self._joints:
            X_AJ = joint.frame_on_child().CalcPose(self._context, self._base)
            axes.append(
                JointAxis(X_AJ.rotation().matrix(), X_AJ.translation(), joint.revolute_axis())
            )
        frames = [RigidTransform()]
        for R, p in zip(*link_frames(tuple(axes)), strict=True):
            frames.append(RigidTransform(RotationMatrix(R), p))
        frames.append(self._tool.CalcPose(self._context, self._base))
        steps = [frames[i].inverse() @ frames[i + 1] for i in range(8)]
        return Chain(
            R=np.array([X.rotation().matrix() for X in steps]),
            p=np.array([X.translation() for X in steps]),
            lower=np.array([joint.position_lower_limits()[0] for joint in self._joints]),
            upper=np.array([joint.position_upper_limits()[0] for joint in self._joints]),
        )


@cache
def drake_arm(name):
    """Return one of `ARMS` in Drake; built once."""
    return DrakeArm(ARMS[name])
