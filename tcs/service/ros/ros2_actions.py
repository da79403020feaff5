"""Jobs as an action of ROS 2: goals, feedback, results, and cancellation."""

from __future__ import annotations

import json
import threading
import time
from collections import OrderedDict
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tcs.errors import DataFileError, TcsError
from tcs.service.engine import Engine
from tcs.service.named_requests import NamedRequests
from tcs.service.operations import OPERATIONS
from tcs.service.responses import JobStatus
from tcs.service.ros.placing import parsed_object
from tcs.service.ros.ros2_entities import Ros2Session

_TYPE = "tcs_msgs/action/RunJob"
_CANCEL = "action_msgs/srv/CancelGoal"
_ACCEPTED, _EXECUTING, _CANCELING, _SUCCEEDED, _CANCELED, _ABORTED = range(1, 7)
"""States of `action_msgs/msg/GoalStatus`."""
_NONE, _REJECTED, _UNKNOWN_GOAL, _TERMINATED = range(4)
"""Return codes of `action_msgs/srv/CancelGoal`."""
_STATE_OF_JOB = {"done": _SUCCEEDED, "cancelled": _CANCELED, "failed": _ABORTED}
_ANY_GOAL = bytes(16)
_INTERVAL = 0.1
"""Shortest time between two messages of feedback [s]."""
_JOBS = frozenset(one.name.replace("-", "_") for one in OPERATIONS if one.is_job)


@dataclass(eq=False)
class _Goal:
    """A goal that was accepted."""

    key: bytes
    stamp: Any
    state: int = _ACCEPTED
    job: str = ""
    end: Future[Any] = field(default_factory=Future)
    """Its result: a message `RunJob_GetResult_Response`."""


class JobActions:
    """The action `run_job`: a request that takes longer than a moment as a goal.

    A goal is always accepted. One whose request is refused is aborted, with the line of the error
    in its result, which a rejected goal could not carry.
    """

    def __init__(
        self, engine: Engine, requests: NamedRequests, session: Ros2Session, name: str
    ) -> None:
        """Offer the action.

        Args:
            engine: The engine.
            requests: Its requests by name.
            session: The node.
            name: Name of the action, e.g. "/tcs/run_job".
        """
        self._engine, self._requests, self._types = engine, requests, session.types
        self._lock = threading.Lock()
        self._goals: OrderedDict[bytes, _Goal] = OrderedDict()
        inner = f"{name}/_action"
        self._feedback = session.add_publisher(f"{inner}/feedback", f"{_TYPE}_FeedbackMessage")
        self._status = session.add_publisher(
            f"{inner}/status", "action_msgs/msg/GoalStatusArray", latched=True
        )
        session.add_service(f"{inner}/send_goal", f"{_TYPE}_SendGoal", self._accept)
        session.add_service(f"{inner}/get_result", f"{_TYPE}_GetResult", self._result)
        session.add_service(f"{inner}/cancel_goal", _CANCEL, self._cancel)

    def _accept(self, request: Any) -> Any:
        """Accept a goal, and do it in a thread of its own."""
        now = time.time_ns()
        stamp = self._types.make(
            "builtin_interfaces/msg/Time", sec=now // 10**9, nanosec=now % 10**9
        )
        goal = _Goal(bytes(request.goal_id.uuid), stamp)
        response = f"{_TYPE}_SendGoal_Response"
        with self._lock:
            if goal.key in self._goals:
                return self._types.make(response, accepted=False)
            self._goals[goal.key] = goal
            self._forget()
        threading.Thread(
            target=self._do, args=(goal, request.goal), name="tcs-goal", daemon=True
        ).start()
        return self._types.make(response, accepted=True, stamp=stamp)

    def _do(self, goal: _Goal, asked: Any) -> None:
        """Do a goal: submit its job, and publish its progress until it has ended."""
        try:
            if asked.name not in _JOBS:
                known = ", ".join(sorted(_JOBS))
                raise DataFileError(
                    f"'{asked.name[:40]}' is not the name of a job. Known: {known}."
                )
            fields = parsed_object(asked.request, "request")
            request: Any = self._requests.checked(asked.name, fields)
            status = self._engine.submit(request)
        except TcsError as error:
            self._ended(goal, "failed", problem=" ".join(str(error).splitlines()))
            return
        with self._lock:
            goal.job = status.job
            is_cancelled = goal.state == _CANCELING
            if not is_cancelled:
                goal.state = _EXECUTING
        if is_cancelled:
            self._engine.cancel(goal.job)
        self._publish_status()
        try:
            while not status.has_ended:
                self._publish_feedback(goal, status)
                time.sleep(_INTERVAL)
                status = self._engine.next_state(goal.job, status, 60.0)
            status = self._engine.job(goal.job)
        except TcsError as error:
            self._ended(goal, "failed", problem=str(error))
            return
        result = "" if status.result is None else json.dumps(status.result, allow_nan=False)
        self._ended(goal, status.state, result=result, problem=status.problem or "")

    def _ended(self, goal: _Goal, state: str, *, result: str = "", problem: str = "") -> None:
        """Set the result of a goal."""
        made = self._types.make(f"{_TYPE}_Result", state=state, result=result, problem=problem)
        with self._lock:
            goal.state = _STATE_OF_JOB[state]
        goal.end.set_result(
            self._types.make(f"{_TYPE}_GetResult_Response", status=goal.state, result=made)
        )
        self._publish_status()

    def _result(self, request: Any) -> Any:
        """Return the result of a goal when it has ended."""
        with self._lock:
            goal = self._goals.get(bytes(request.goal_id.uuid))
        if goal is None:
            return self._types.make(f"{_TYPE}_GetResult_Response")
        return goal.end

    def _cancel(self, request: Any) -> Any:
        """Cancel a goal, or all goals if no goal is named."""
        key = bytes(request.goal_info.goal_id.uuid)
        with self._lock:
            named = [*self._goals.values()] if key == _ANY_GOAL else [self._goals.get(key)]
            open_ = [one for one in named if one is not None and not one.end.done()]
            for goal in open_:
                goal.state = _CANCELING
        for goal in open_:
            if goal.job:
                self._engine.cancel(goal.job)
        code = _NONE
        if named == [None]:
            code = _UNKNOWN_GOAL
        elif key != _ANY_GOAL and not open_:
            code = _TERMINATED
        self._publish_status()
        infos = [self._info(goal) for goal in open_]
        return self._types.make(f"{_CANCEL}_Response", return_code=code, goals_canceling=infos)

    def _info(self, goal: _Goal) -> Any:
        return self._types.make(
            "action_msgs/msg/GoalInfo", goal_id=self._uuid(goal), stamp=goal.stamp
        )

    def _uuid(self, goal: _Goal) -> Any:
        uuid = np.frombuffer(goal.key, dtype=np.uint8)
        return self._types.make("unique_identifier_msgs/msg/UUID", uuid=uuid)

    def _publish_feedback(self, goal: _Goal, status: JobStatus) -> None:
        feedback = self._types.make(
            f"{_TYPE}_Feedback", state=status.state, done=status.done, total=status.total,
            note=status.note,
        )  # fmt: skip
        self._feedback(
            self._types.make(
                f"{_TYPE}_FeedbackMessage", goal_id=self._uuid(goal), feedback=feedback
            )
        )

    def _publish_status(self) -> None:
        with self._lock:
            found = [
                self._types.make(
                    "action_msgs/msg/GoalStatus", goal_info=self._info(goal), status=goal.state
                )
                for goal in self._goals.values()
            ]
        self._status(self._types.make("action_msgs/msg/GoalStatusArray", status_list=found))

    def _forget(self) -> None:
        """Forget the oldest goals that have ended, beyond the number of jobs that is kept."""
        ended = [key for key, goal in self._goals.items() if goal.end.done()]
        for key in ended[: max(len(ended) - self._engine.limits.kept_jobs, 0)]:
            del self._goals[key]
