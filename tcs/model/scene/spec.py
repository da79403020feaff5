"""Specification of a scene as a value: the robot file and the environment file."""

from __future__ import annotations

from dataclasses import dataclass

from tcs.model.robots import RobotFile
from tcs.model.scene.environment import EnvironmentFile


@dataclass(frozen=True, slots=True)
class SceneSpec:
    """One robot in one environment.

    It is hashable and picklable, which a live Drake plant is not: pass it to a worker process,
    which builds its own `Scene`.
    """

    robot: RobotFile
    environment: EnvironmentFile
