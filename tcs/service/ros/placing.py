"""Where to stand for a task, with robot and person where tf shows them (TCS, Fig. 2)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tcs.errors import DataFileError, NotFoundError, ServiceError
from tcs.files.documents import checked
from tcs.service.engine import Engine
from tcs.service.requests import JobRequest, PlanRequest, ScoreHereRequest, SelectRequest
from tcs.service.responses import FileEntry
from tcs.service.ros.frames import FrameNames, Pose, TransformTree

_BASE = ("base_x", "base_y", "base_yaw_deg", "torso", "hand", "window")
_FROM_TF = ("file", "here", "torso", "at", "frames")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceRequest:
    """A semantic request: the fields of `PlaceRobot.srv`."""

    file: str = ""
    task: str = ""
    environment: str = ""
    robot: str = ""
    score_scene: bool = False
    torso_height: float = 0.0
    settings: Mapping[str, float]
    """Present state of the environment [m or rad]."""
    options: str = ""
    plan: bool = False


@dataclass(frozen=True, slots=True)
class Trajectory:
    """A motion of the arm."""

    joints: tuple[str, ...]
    times: list[float]
    positions: list[list[float]]
    velocities: list[list[float]]


@dataclass(frozen=True, slots=True)
class PlacedStop:
    """Where the robot stands, and how torso and environment are set."""

    x: float
    y: float
    yaw: float
    """Heading [rad]."""
    torso: float
    settings: dict[str, float]
    """Axes of the environment [m or rad]."""
    goals: tuple[int, ...] = ()
    trajectories: tuple[Trajectory, ...] = ()


@dataclass(frozen=True, slots=True)
class PlacedRobot:
    """The answer to a semantic request."""

    file: str
    stops: tuple[PlacedStop, ...]
    """In the order of the tour, in the frame of the environment."""
    choice: dict[str, Any]
    """The answer of `select`."""


class Placer:
    """Answers semantic requests with an engine and the transforms of tf."""

    def __init__(self, engine: Engine, tree: TransformTree, names: FrameNames) -> None:
        """Answer with an engine.

        Args:
            engine: The engine.
            tree: The transforms.
            names: Names of their frames.
        """
        self._engine, self._tree, self.names = engine, tree, names

    def place(self, request: PlaceRequest) -> PlacedRobot:
        """Return the initial configurations with the greatest utility from where the robot is.

        Raises:
            NotFoundError: If no score file is held for the request.
            ServiceError: If frames are missing, tilted or too old, or a job fails.
            TcsError: As `Engine.select`.
        """
        entry = self._entry(request)
        here = self._tree.pose(self.names.base, self.names.environment).base_pose()
        person = {
            name: self._tree.pose(frame, self.names.environment)
            for name, frame in self.names.person.items()
        }
        at = _settings_in(entry, request)
        state = {"here": here, "torso": request.torso_height, "at": at}
        digest, frames = entry.file, _positions(person)
        if request.score_scene:
            digest, frames = self._scored_as_seen(entry, at, person), {}
        fields = {**_options(request.options), "file": digest, "frames": frames, **state}
        choice = self._engine.select(checked(fields, SelectRequest, "options", DataFileError))
        stops = tuple(_stop(member) for member in choice["members"])
        if request.plan:
            stops = self._planned(digest, choice, {**state, "frames": frames}, stops)
        return PlacedRobot(digest, stops, choice)

    def _entry(self, request: PlaceRequest) -> FileEntry:
        """Return the newest score file of a request."""
        wanted = {
            key: getattr(request, key)
            for key in ("file", "task", "environment", "robot")
            if getattr(request, key)
        }
        held = self._engine.files()
        found = [e for e in held if all(getattr(e, key) == wanted[key] for key in wanted)]
        text = ", ".join(f"{key} '{value[:40]}'" for key, value in wanted.items()) or "any task"
        if not found:
            titles = "; ".join(entry.title for entry in held) or "none"
            raise NotFoundError(
                f"no score file of {text} is held. Held: {titles}. Name one when the node starts, "
                "or score the task with the request `score`."
            )
        if len({(e.task, e.environment, e.robot) for e in found}) > 1:
            titles = "; ".join(entry.title for entry in found)
            raise ServiceError(f"several score files are of {text}: {titles}. Name more of it.")
        return found[-1]

    def _scored_as_seen(
        self, entry: FileEntry, at: dict[str, float], person: Mapping[str, Pose]
    ) -> str:
        """Score the task in the observed scene; return the digest of the scores."""
        if not person:
            raise ServiceError(
                "`score_scene` needs a frame of the person. Start the node with --person-frame."
            )
        frames = {
            name: [*pose.p_AoBo_A.tolist(), *pose.quaternion_wxyz()]
            for name, pose in person.items()
        }
        done = self._done(
            ScoreHereRequest(
                task=entry.task, environment=entry.environment, robot=entry.robot, at=at,
                frames=frames,
            )
        )  # fmt: skip
        return str(done["file"])

    def _planned(
        self,
        digest: str,
        choice: Mapping[str, Any],
        state: dict[str, Any],
        stops: tuple[PlacedStop, ...],
    ) -> tuple[PlacedStop, ...]:
        """Return the stops with the motions that do the task from there."""
        if "refined" in choice:
            raise ServiceError(
                "the set lies between the points of the grid and is not planned. Name a file whose "
                "sets are not refined, or do without `plan`."
            )
        plan = self._done(
            PlanRequest(file=digest, configuration=choice["configurations"], frames=state["frames"])
        )
        joints = tuple(plan["joints"])
        found = {stop["configuration"]: stop for stop in plan["stops"]}
        return tuple(
            _with_motions(stop, found.get(index), joints)
            for stop, index in zip(stops, choice["configurations"], strict=True)
        )

    def _done(self, request: JobRequest) -> dict[str, Any]:
        """Return the result of a job."""
        status = self._engine.wait(self._engine.submit(request).job)
        if status.result is None:
            raise ServiceError(f"the job {status.what} {status.state}: {status.problem}")
        return status.result


def _positions(person: Mapping[str, Pose]) -> dict[str, list[float]]:
    """Return positions of body frames in the environment [m]."""
    return {name: pose.p_AoBo_A.tolist() for name, pose in person.items()}


def _settings_in(entry: FileEntry, request: PlaceRequest) -> dict[str, float]:
    """Return settings under the names of requests: in degrees under names that end in `_deg`."""
    at = {}
    for name, value in request.settings.items():
        in_degrees = f"{name}_deg" in entry.settings
        at[f"{name}_deg" if in_degrees else name] = math.degrees(value) if in_degrees else value
    return at


def _options(text: str) -> dict[str, Any]:
    """Return the further fields of `select`."""
    fields = parsed_object(text, "options")
    for name in _FROM_TF:
        if name in fields:
            raise DataFileError(f"options: '{name}' is a field of the request, or comes from tf.")
    return fields


def parsed_object(text: str, what: str) -> dict[str, Any]:
    """Return a JSON object; an empty text is an empty object.

    Args:
        text: The text.
        what: Name of the field, for the message.

    Raises:
        DataFileError: If it is not a JSON object.
    """
    try:
        fields = json.loads(text or "{}")
    except (ValueError, RecursionError) as error:
        why = "too deep" if isinstance(error, RecursionError) else str(error)
        raise DataFileError(f"{what} is not valid JSON: {why}.") from None
    if not isinstance(fields, dict):
        raise DataFileError(f"{what} must be a JSON object.")
    return fields


def _stop(member: Mapping[str, Any]) -> PlacedStop:
    settings = {
        name.removesuffix("_deg"): math.radians(value) if name.endswith("_deg") else float(value)
        for name, value in member.items()
        if name not in _BASE
    }
    x, y, yaw_deg, torso = (float(member[name]) for name in _BASE[:4])
    return PlacedStop(x, y, math.radians(yaw_deg), torso, settings)


def _with_motions(
    stop: PlacedStop, planned: Mapping[str, Any] | None, joints: tuple[str, ...]
) -> PlacedStop:
    if planned is None:
        return stop
    trajectories = tuple(
        Trajectory(joints, segment["times"], segment["positions"], segment["velocities"])
        for segment in planned["segments"]
    )
    return PlacedStop(
        stop.x, stop.y, stop.yaw, stop.torso, stop.settings, tuple(planned["goals"]), trajectories
    )
