"""A node of ROS 1: the requests of the service by name, and where to stand, from tf."""

from __future__ import annotations

import importlib
import json
import math
import socket
import threading
from collections.abc import Callable
from contextlib import ExitStack
from types import SimpleNamespace, TracebackType
from typing import Any, Self
from urllib.parse import urlsplit

from tcs.errors import ServiceError, TcsError
from tcs.service.engine import Engine
from tcs.service.named_requests import NamedRequests, named_problem
from tcs.service.ros.frames import FrameNames, TransformTree
from tcs.service.ros.messages import place_request, placed_fields, pose_of
from tcs.service.ros.placing import PlacedStop, Placer, parsed_object
from tcs.service.ros.ros1_types import ros1_modules, ros1_types

_MASTER_SECONDS = 5.0
"""Longest wait for the master [s]."""


class Ros1Node:
    """Services of ROS 1 that answer with an engine; a context manager that ends them.

    A process has one node of ROS 1 in its lifetime: rospy allows no second one.
    """

    def __init__(
        self, engine: Engine, names: FrameNames, *, max_age: float, name: str = "tcs"
    ) -> None:
        """Start the node and its services.

        Args:
            engine: The engine.
            names: Names of the frames in tf.
            max_age: Longest time since the last message of a transform that is not static [s].
            name: Name of the node.

        Raises:
            ServiceError: If a package of ROS 1 is not installed, or no master answers.
        """
        self._ros = ros1_modules()
        self._requests = NamedRequests(engine, job_seconds=0.0)
        self._tree = TransformTree(max_age)
        self._placer = Placer(engine, self._tree, names)
        self._stack = ExitStack()
        self._types = self._stack.enter_context(ros1_types())
        rospy = self._ros.rospy
        if not rospy.core.is_initialized():
            _check_master()
            rospy.init_node(name, disable_signals=True)
        for request in self._requests:
            self._add(request.name, self._types.srv.Call, self._call(request.name))
        self._add("place_robot", self._types.srv.PlaceRobot, self._place)
        for topic, is_static in (("/tf", False), ("/tf_static", True)):
            subscriber = rospy.Subscriber(
                topic, self._ros.tf2_msgs.TFMessage, self._on_transforms, is_static, queue_size=100
            )
            self._stack.callback(subscriber.unregister)

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
        self._stack.close()

    def run(self) -> None:
        """Answer requests until interrupted, or the node is shut down by another program."""
        ended = threading.Event()
        self._ros.rospy.on_shutdown(ended.set)
        while not ended.wait(1.0):
            pass

    def _add(self, name: str, service_class: Any, answer: Callable[[Any], Any]) -> None:
        service = self._ros.rospy.Service(f"~{name}", service_class, answer)
        self._stack.callback(service.shutdown, "the service ends")

    def _call(self, name: str) -> Callable[[Any], Any]:
        """Return what answers a request by name."""

        def answer(call: Any) -> Any:
            response = self._types.srv.CallResponse()
            try:
                found = self._requests.answer(name, parsed_object(call.request, "request"))
            except TcsError as error:
                problem = named_problem(error)
                response.error, response.detail = problem["title"], problem["detail"]
            else:
                response.success, response.answer = True, json.dumps(found, allow_nan=False)
            return response

        return answer

    def _place(self, call: Any) -> Any:
        """Answer a semantic request."""
        try:
            placement = self._placer.place(place_request(call))
        except TcsError as error:
            problem = named_problem(error)
            return self._types.srv.PlaceRobotResponse(
                error=problem["title"], detail=problem["detail"]
            )
        fields = placed_fields(placement, self._factory())
        return self._types.srv.PlaceRobotResponse(**fields)

    def _factory(self) -> SimpleNamespace:
        """Return what makes the messages of an answer."""
        now, frame = self._ros.rospy.get_rostime(), self._placer.names.environment

        def pose(stop: PlacedStop) -> Any:
            made = self._ros.geometry_msgs.PoseStamped()
            made.header.stamp, made.header.frame_id = now, frame
            made.pose.position.x, made.pose.position.y = stop.x, stop.y
            made.pose.orientation.z = math.sin(stop.yaw / 2.0)
            made.pose.orientation.w = math.cos(stop.yaw / 2.0)
            return made

        return SimpleNamespace(
            setting=self._types.msg.Setting,
            configuration=self._types.msg.InitialConfiguration,
            trajectory=self._ros.trajectory_msgs.JointTrajectory,
            point=self._ros.trajectory_msgs.JointTrajectoryPoint,
            duration=self._ros.rospy.Duration.from_sec,
            integers=list,
            numbers=list,
            pose=pose,
        )

    def _on_transforms(self, message: Any, is_static: bool) -> None:
        """Record the transforms of a message."""
        for one in message.transforms:
            try:
                pose = pose_of(one.transform)
            except ServiceError as error:
                self._ros.rospy.logwarn_throttle(10.0, f"'{one.child_frame_id}': {error}")
                continue
            self._tree.set(one.header.frame_id, one.child_frame_id, pose, is_static=is_static)


def _check_master() -> None:
    """Check that a master answers: rospy itself would wait for it for ever.

    Raises:
        ServiceError: If none does.
    """
    rosgraph = importlib.import_module("rosgraph")
    address = rosgraph.get_master_uri()
    parts = urlsplit(address)
    try:
        socket.create_connection((parts.hostname, parts.port or 11311), _MASTER_SECONDS).close()
    except OSError as error:
        raise ServiceError(
            f"no ROS master answers at {address} ({error.strerror or error}). Start one, e.g. "
            "`rosmaster --core`, or set ROS_MASTER_URI."
        ) from None
