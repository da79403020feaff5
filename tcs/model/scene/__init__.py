"""Scenes: a robot in an environment, as a live Drake plant or as arrays for the kernel.

In: a robot file and an environment file. Out: a plant that places the robot and checks contacts,
and its lowering to arrays, from which the kernel computes the same.
"""

from __future__ import annotations

from tcs.model.scene.environment.environment_file import (
    EMPTY_ENVIRONMENT,
    EnvironmentFile,
    ModelEntry,
    Obstacle,
    environment_names,
    load_environment,
    with_person,
)
from tcs.model.scene.environment.error_distribution import ErrorDistribution
from tcs.model.scene.environment.shapes import environment_shapes
from tcs.model.scene.lowered_scene import LoweredScene, without_bodies
from tcs.model.scene.lowering import (
    alternative_poses,
    arm_chain,
    environment_at,
    goal_poses,
    lower,
    torso_at,
)
from tcs.model.scene.neighbours import NeighbourList
from tcs.model.scene.observation import JointEstimate, Observation, estimate_joints
from tcs.model.scene.person.goals import goals_on_person
from tcs.model.scene.person.people import PeopleInScene
from tcs.model.scene.person.posture import Posture
from tcs.model.scene.scene import Contact, Scene, body_frame_positions
from tcs.model.scene.spec import SceneSpec
from tcs.model.scene.surface_goals import with_surface_goals
from tcs.model.scene.turning import axis_of_turn

__all__ = [
    "EMPTY_ENVIRONMENT",
    "Contact",
    "EnvironmentFile",
    "ErrorDistribution",
    "JointEstimate",
    "LoweredScene",
    "ModelEntry",
    "NeighbourList",
    "Observation",
    "Obstacle",
    "PeopleInScene",
    "Posture",
    "Scene",
    "SceneSpec",
    "alternative_poses",
    "arm_chain",
    "axis_of_turn",
    "body_frame_positions",
    "environment_at",
    "environment_names",
    "environment_shapes",
    "estimate_joints",
    "goal_poses",
    "goals_on_person",
    "load_environment",
    "lower",
    "torso_at",
    "with_person",
    "with_surface_goals",
    "without_bodies",
]
