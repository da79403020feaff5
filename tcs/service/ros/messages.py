"""Fields of ROS messages from and to the values of the service, the same in ROS 1 and ROS 2."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from tcs.errors import DataFileError
from tcs.service.ros.frames import Pose
from tcs.service.ros.placing import PlacedRobot, PlacedStop, PlaceRequest, Trajectory


def pose_of(transform: Any) -> Pose:
    """Return the pose of a `geometry_msgs/Transform`.

    Raises:
        ServiceError: If it is not a rigid transform.
    """
    p, q = transform.translation, transform.rotation
    return Pose.of_quaternion(np.array([p.x, p.y, p.z]), np.array([q.x, q.y, q.z, q.w]))


def place_request(message: Any) -> PlaceRequest:
    """Return the semantic request of a message `PlaceRobot_Request`.

    Raises:
        DataFileError: If a setting is given twice, or a number is not finite.
    """
    settings: dict[str, float] = {}
    for one in message.environment_settings:
        if one.name in settings:
            raise DataFileError(f"environment_settings: '{one.name[:40]}' is set twice.")
        settings[one.name] = float(one.value)
    for name, value in {"torso_height": message.torso_height, **settings}.items():
        if not math.isfinite(value):
            raise DataFileError(f"'{name[:40]}' is {value}; must be a finite number.")
    return PlaceRequest(
        file=message.file,
        task=message.task,
        environment=message.environment,
        robot=message.robot,
        score_scene=bool(message.score_scene),
        torso_height=float(message.torso_height),
        settings=settings,
        options=message.options,
        plan=bool(message.plan),
    )


def placed_fields(placement: PlacedRobot, factory: Any) -> dict[str, Any]:
    """Return the fields of a message `PlaceRobot_Response`.

    Args:
        placement: The answer.
        factory: Makes messages: `setting`, `configuration`, `trajectory` and `point` are called
            with the fields of the message, `pose` with a stop, `duration` with seconds, and
            `integers` and `numbers` with lists.
    """
    choice = placement.choice
    return {
        "success": True,
        "error": "",
        "detail": "",
        "file": placement.file,
        "configurations": [_configuration(stop, factory) for stop in placement.stops],
        "reachability": float(choice["reachability"]),
        "manipulability": float(choice["manipulability"]),
        "net_utility": float(choice["net_utility"]),
        "answer": json.dumps(choice, allow_nan=False),
    }


def _configuration(stop: PlacedStop, factory: Any) -> Any:
    return factory.configuration(
        base_pose=factory.pose(stop),
        torso_height=stop.torso,
        environment=[factory.setting(name=n, value=v) for n, v in stop.settings.items()],
        goals=factory.integers(stop.goals),
        trajectories=[_trajectory(one, factory) for one in stop.trajectories],
    )


def _trajectory(motion: Trajectory, factory: Any) -> Any:
    return factory.trajectory(
        joint_names=list(motion.joints),
        points=[
            factory.point(
                positions=factory.numbers(positions),
                velocities=factory.numbers(velocities),
                time_from_start=factory.duration(time),
            )
            for time, positions, velocities in zip(
                motion.times, motion.positions, motion.velocities, strict=True
            )
        ],
    )
