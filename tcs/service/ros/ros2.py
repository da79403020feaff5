"""A node of ROS 2 without ROS installed: the requests by name, jobs as actions, where to stand."""

from __future__ import annotations

import json
import math
import os
import threading
import time
from functools import partial
from types import SimpleNamespace, TracebackType
from typing import Any, Self

import numpy as np
import zenoh

from tcs.errors import ServiceError, TcsError
from tcs.service.engine import Engine
from tcs.service.named_requests import NamedRequests, named_problem
from tcs.service.ros.frames import FrameNames, TransformTree
from tcs.service.ros.messages import place_request, placed_fields, pose_of
from tcs.service.ros.placing import PlacedStop, Placer, parsed_object
from tcs.service.ros.ros2_actions import JobActions
from tcs.service.ros.ros2_entities import Ros2Session
from tcs.service.ros.ros2_types import Ros2Types

_CALL = "tcs_msgs/srv/Call"
_PLACE = "tcs_msgs/srv/PlaceRobot"


def domain_of_environment() -> int:
    """Return the number of the domain, `ROS_DOMAIN_ID`, or 0.

    Raises:
        ServiceError: If the variable is not a number from 0 to 232.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "").strip() or "0"
    if not (text.isdecimal() and int(text) <= 232):
        raise ServiceError(f"ROS_DOMAIN_ID is '{text[:20]}'; must be a number from 0 to 232.")
    return int(text)


class Ros2Node:
    """Services and actions of ROS 2 that answer with an engine; a context manager."""

    def __init__(
        self,
        engine: Engine,
        names: FrameNames,
        config: zenoh.Config,
        *,
        max_age: float,
        domain: int = 0,
        name: str = "tcs",
    ) -> None:
        """Start the node and its services.

        Args:
            engine: The engine.
            names: Names of the frames in tf.
            config: Configuration of Zenoh, as by `zenoh_config`.
            max_age: Longest time since the last message of a transform that is not static [s].
            domain: Number of the domain.
            name: Name of the node.

        Raises:
            ServiceError: If the session cannot be opened.
        """
        self._types = Ros2Types()
        self._tree = TransformTree(max_age)
        self._placer = Placer(engine, self._tree, names)
        self._requests = NamedRequests(engine, job_seconds=0.0)
        self._session = Ros2Session(config, self._types, name, domain)
        for request in self._requests:
            self._session.add_service(
                f"/{name}/{request.name}", _CALL, partial(self._call, request.name)
            )
        self._session.add_service(f"/{name}/place_robot", _PLACE, self._place)
        self._actions = JobActions(engine, self._requests, self._session, f"/{name}/run_job")
        for topic, is_static in (("/tf", False), ("/tf_static", True)):
            receive = partial(self._on_transforms, is_static=is_static)
            self._session.add_subscriber(
                topic, "tf2_msgs/msg/TFMessage", receive, latched=is_static
            )

    def __enter__(self) -> Self:
        """Return the node."""
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """End the services."""
        self._session.close()

    def run(self) -> None:
        """Answer requests until interrupted."""
        forever = threading.Event()
        while not forever.wait(60.0):
            pass

    def _call(self, name: str, call: Any) -> Any:
        """Answer a request by name."""
        make = partial(self._types.make, f"{_CALL}_Response")
        try:
            found = self._requests.answer(name, parsed_object(call.request, "request"))
        except TcsError as error:
            problem = named_problem(error)
            return make(error=problem["title"], detail=problem["detail"])
        return make(success=True, answer=json.dumps(found, allow_nan=False))

    def _place(self, call: Any) -> Any:
        """Answer a semantic request."""
        make = partial(self._types.make, f"{_PLACE}_Response")
        try:
            placement = self._placer.place(place_request(call))
        except TcsError as error:
            problem = named_problem(error)
            return make(error=problem["title"], detail=problem["detail"])
        return make(**placed_fields(placement, self._factory()))

    def _factory(self) -> SimpleNamespace:
        """Return what makes the messages of an answer."""
        make, now = self._types.make, time.time()
        header = make(
            "std_msgs/msg/Header", stamp=self._time("Time", now),
            frame_id=self._placer.names.environment,
        )  # fmt: skip

        def pose(stop: PlacedStop) -> Any:
            half = stop.yaw / 2.0
            position = make("geometry_msgs/msg/Point", x=stop.x, y=stop.y)
            turned = make("geometry_msgs/msg/Quaternion", z=math.sin(half), w=math.cos(half))
            at = make("geometry_msgs/msg/Pose", position=position, orientation=turned)
            return make("geometry_msgs/msg/PoseStamped", header=header, pose=at)

        return SimpleNamespace(
            setting=partial(make, "tcs_msgs/msg/Setting"),
            configuration=partial(make, "tcs_msgs/msg/InitialConfiguration"),
            trajectory=partial(make, "trajectory_msgs/msg/JointTrajectory"),
            point=partial(make, "trajectory_msgs/msg/JointTrajectoryPoint"),
            duration=partial(self._time, "Duration"),
            integers=partial(np.array, dtype=np.int32),
            numbers=partial(np.array, dtype=np.float64),
            pose=pose,
        )

    def _time(self, name: str, seconds: float) -> Any:
        nanoseconds = round(seconds * 1e9)
        return self._types.make(
            f"builtin_interfaces/msg/{name}",
            sec=nanoseconds // 1_000_000_000,
            nanosec=nanoseconds % 1_000_000_000,
        )

    def _on_transforms(self, message: Any, *, is_static: bool) -> None:
        """Record the transforms of a message."""
        for one in message.transforms:
            self._tree.set(
                one.header.frame_id, one.child_frame_id, pose_of(one.transform),
                is_static=is_static,
            )  # fmt: skip
