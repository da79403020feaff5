"""Scenes: a robot in an environment, as a live Drake plant or as arrays for the kernel."""

from __future__ import annotations

from tcs.model.scene.environment import (
    NOWHERE,
    EnvironmentFile,
    ModelEntry,
    Obstacle,
    environment_names,
    load_environment,
)
from tcs.model.scene.frames import body_frame_places
from tcs.model.scene.joint_error import JointError
from tcs.model.scene.lowering import LoweredScene, arm_chain, environment_at, goal_poses, lower
from tcs.model.scene.observation import Found, Observation, find_joints
from tcs.model.scene.posture import Posture
from tcs.model.scene.scene import Contact, Scene
from tcs.model.scene.spec import SceneSpec

__all__ = [
    "NOWHERE",
    "Contact",
    "EnvironmentFile",
    "Found",
    "JointError",
    "LoweredScene",
    "ModelEntry",
    "Observation",
    "Obstacle",
    "Posture",
    "Scene",
    "SceneSpec",
    "arm_chain",
    "body_frame_places",
    "environment_at",
    "environment_names",
    "find_joints",
    "goal_poses",
    "load_environment",
    "lower",
]
