"""Specification of a scene as a value: the robot file and the environment file."""

from __future__ import annotations

from dataclasses import dataclass

from tcs.model.robots import RobotFile
from tcs.model.scene.environment.environment_file import EnvironmentFile
from tcs.model.scene.mounting import bolted


@dataclass(frozen=True, slots=True)
class SceneSpec:
    """One robot in one environment, without its pedestal if it is mounted on furniture there.

    It is hashable and picklable, which a live Drake plant is not: pass it to a worker process,
    which builds its own `Scene`.
    """

    robot: RobotFile
    environment: EnvironmentFile

    def __post_init__(self) -> None:
        """Take the robot off its pedestal, if the environment has a mount.

        Raises:
            RobotError: If the robot cannot be mounted on furniture.
        """
        if self.environment.mount is not None:
            object.__setattr__(self, "robot", bolted(self.robot, self.environment.mount))
