"""Task files: their format, and those that ship with `tcs`."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field

from tcs.errors import TaskError, UnknownNameError
from tcs.files.documents import Document, read_document
from tcs.files.paths import DataFiles, expanded, is_path
from tcs.model.tasks.freedom import Freedom
from tcs.model.tasks.surface import Surface
from tcs.model.tasks.task import Goal, GoalPose, KeepOut, Task, partners
from tcs.model.tasks.tool_line import DEFAULT_APPROACH, ToolLine

POSE = ("body_frame", "position", "quaternion_wxyz")
"""Keys that a pose needs."""
TASKS = DataFiles("task", "tasks/*/*.yaml")


class _Entry(Document):
    """Part of a task file with strict types: text is never converted to a number."""

    model_config = ConfigDict(strict=True)


class LineEntry(_Entry):
    """A straight motion of the tool: direction in the tool frame, and length [m]."""

    direction: list[float]
    distance: float


class ConeEntry(_Entry):
    """An axis that may tilt by an angle in any direction."""

    axis: list[float]
    half_angle_deg: float


class SymmetryEntry(_Entry):
    """An axis about which several angles are equivalent."""

    axis: list[float]
    fold: int


class FreeEntry(_Entry):
    """What is free about a goal; the axes are those of the tool frame at the goal."""

    rotation_about: list[float] | None = None
    cone: ConeEntry | None = None
    symmetry: SymmetryEntry | None = None
    orientation: bool = False
    position: list[float] | None = None


class PoseEntry(_Entry):
    """A pose at which a goal is reached; what an alternative leaves out is that of its goal."""

    body_frame: str | None = None
    position: list[float] | None = None
    quaternion_wxyz: list[float] | None = None
    free: Literal["orientation", "nothing"] | FreeEntry | None = None


class GoalEntry(PoseEntry):
    """One goal of a task file."""

    alternatives: list[PoseEntry] | None = None
    weight: float = 1.0
    name: str = ""
    arm: str = ""
    tool: str = ""
    together_with: str = ""
    approach: LineEntry | None = None
    retreat: LineEntry | None = None


class SurfaceEntry(_Entry):
    """A surface that is covered with goals."""

    body: str
    spacing: float
    normal: str = "inward"
    distance: float = 0.04
    facing: list[float] | None = None
    weight: float = 1.0
    free: Literal["orientation", "nothing"] | FreeEntry | None = None
    arm: str = ""
    tool: str = ""
    approach: LineEntry | None = None
    retreat: LineEntry | None = None


def _listed(value: object) -> object:
    """Return a single entry as a list of one."""
    return [value] if isinstance(value, Mapping) else value


class KeepOutEntry(_Entry):
    """A box in a body frame: centre and full sizes [m]."""

    body_frame: str
    position: list[float]
    box: list[float]


class AxisEntry(_Entry):
    """Changes of a task to one axis of an environment's grid."""

    start: float | None = None
    step: float | None = None
    count: int | None = None


class TaskFile(_Entry):
    """The content of a task file."""

    name: str
    title: str
    source: str
    environments: list[str]
    goals: list[GoalEntry] = Field(default_factory=list)
    surface: Annotated[list[SurfaceEntry], BeforeValidator(_listed)] = Field(default_factory=list)
    tool: str = ""
    tools: dict[str, str] = Field(default_factory=dict)
    free: Literal["orientation", "nothing"] | FreeEntry | None = None
    approach: LineEntry | None = None
    retreat: LineEntry | None = None
    keep_out: list[KeepOutEntry] = Field(default_factory=list)
    allowed_contacts: list[list[str]] = Field(default_factory=list)
    grids: dict[str, dict[str, AxisEntry]] = Field(default_factory=dict)


def task_names() -> tuple[str, ...]:
    """Return the names of the tasks that ship with `tcs`, sorted."""
    return TASKS.names()


def load_task(name_or_path: str | Path) -> Task:
    """Return a task.

    Args:
        name_or_path: One of `task_names()`, or the path of a file: a text that ends in `.yaml` or
            contains a path separator.

    Raises:
        UnknownNameError: If no task has that name, or a key in the file is unknown.
        TaskError: If the file cannot be read or its content is invalid.

    >>> len(load_task("shaving").goals)
    8
    """
    return _read(TASKS.path(name_or_path))


def _read(path: Path) -> Task:
    where = f"task file '{path}'"
    written = read_document(path, TaskFile, where, TaskError)
    goals = []
    for i, entry in enumerate(written.goals):
        try:
            goals.append(_goal(entry, written))
        except TaskError as error:
            raise TaskError(f"{where}, goals[{i}]: {error}") from None
    surfaces = []
    for i, surface in enumerate(written.surface):
        try:
            surfaces.append(_surface(surface, written))
        except TaskError as error:
            raise TaskError(f"{where}, surface[{i}]: {error}") from None
    for i, pair in enumerate(written.allowed_contacts):
        if len(pair) != 2:
            raise TaskError(
                f"{where}, field 'allowed_contacts[{i}]' is {pair}, but must name two bodies."
            )
    try:
        task = Task(
            name=written.name,
            title=written.title,
            goals=tuple(goals),
            environments=tuple(written.environments),
            source=written.source,
            tool=written.tool,
            tools={name: _tool_file(name, tool, path) for name, tool in written.tools.items()},
            allowed_contacts=tuple((pair[0], pair[1]) for pair in written.allowed_contacts),
            surfaces=tuple(surfaces),
            keep_out=tuple(_keep_out(i, entry) for i, entry in enumerate(written.keep_out)),
            grids={
                environment: {
                    axis: entry.model_dump(exclude_none=True) for axis, entry in axes.items()
                }
                for environment, axes in written.grids.items()
            },
        )
        partners(task.goals)
        return task
    except TaskError as error:
        raise TaskError(f"{where}, {error}") from None
    except UnknownNameError as error:
        raise UnknownNameError(
            error.what, error.name, error.known, where=f"{where}, {error.where}"
        ) from None


def _lines(entry: GoalEntry | SurfaceEntry, task: TaskFile) -> tuple[ToolLine, ToolLine]:
    """Return the straight motions of a goal: its own, or those of the task, or the default."""
    approach = _line(entry.approach or task.approach, "approach") or DEFAULT_APPROACH
    retreat = _line(entry.retreat or task.retreat, "retreat") or approach.reverse()
    return approach, retreat


def _surface(entry: SurfaceEntry, task: TaskFile) -> Surface:
    approach, retreat = _lines(entry, task)
    return Surface(
        body=entry.body,
        spacing=entry.spacing,
        normal=entry.normal,
        distance=entry.distance,
        facing=None if entry.facing is None else _three(entry.facing, "facing"),
        weight=entry.weight,
        free=_freedom(entry.free if entry.free is not None else task.free),
        arm=entry.arm,
        tool=entry.tool,
        approach=approach,
        retreat=retreat,
    )


def _tool_file(name: str, tool: str, task: Path) -> str:
    """Return the name of a tool that ships, or the absolute path of a tool file beside a task."""
    if not is_path(tool):
        return tool
    return os.path.realpath(task.parent / expanded(tool, f"field 'tools.{name}'", TaskError))


def _goal(entry: GoalEntry, task: TaskFile) -> Goal:
    approach, retreat = _lines(entry, task)
    poses = _poses(entry, task)
    return Goal(
        body_frame=poses[0].body_frame,
        position=poses[0].position,
        quaternion=poses[0].quaternion,
        weight=entry.weight,
        name=entry.name,
        free=poses[0].free,
        alternatives=tuple(poses[1:]),
        arm=entry.arm,
        tool=entry.tool,
        together_with=entry.together_with,
        approach=approach,
        retreat=retreat,
    )


def _poses(entry: GoalEntry, task: TaskFile) -> list[GoalPose]:
    """Return the poses of a goal: its own, if it is whole, and its alternatives.

    Raises:
        TaskError: If there is none, or a value is missing or invalid.
    """
    alone = entry.alternatives is None
    missing = [key for key in POSE if getattr(entry, key) is None]
    if alone and missing:
        raise TaskError(
            f"field '{missing[0]}' is missing. A goal needs {', '.join(POSE)}, or a list of poses, "
            "'alternatives'."
        )
    if entry.alternatives is not None and not entry.alternatives:
        raise TaskError("field 'alternatives' is empty. List poses, or leave it out.")
    poses = [] if missing else [_pose(entry, entry, task)]
    for i, other in enumerate(entry.alternatives or ()):
        try:
            poses.append(_pose(other, entry, task))
        except TaskError as error:
            raise TaskError(f"alternatives[{i}]: {error}") from None
    return poses


def _pose(entry: PoseEntry, goal: GoalEntry, task: TaskFile) -> GoalPose:
    """Return a pose of a goal, with what its entry leaves out taken from that of the goal.

    Raises:
        TaskError: If a value is missing in both, or invalid.
    """
    given = {}
    for key in POSE:
        own = getattr(entry, key)
        given[key] = getattr(goal, key) if own is None else own
        if given[key] is None:
            raise TaskError(
                f"field '{key}' is missing. Give it here, or to the goal for all poses."
            )
    frees = (entry.free, goal.free, task.free)
    return GoalPose(
        body_frame=given["body_frame"],
        position=np.array(given["position"], dtype=np.float64),
        quaternion=np.array(given["quaternion_wxyz"], dtype=np.float64),
        free=_freedom(next((free for free in frees if free is not None), None)),
    )


def _freedom(entry: str | FreeEntry | None) -> Freedom | None:
    """Return what is free about a goal, None for nothing.

    Raises:
        TaskError: If a value is invalid, or two of them contradict each other.
    """
    if entry is None or entry == "nothing":
        return None
    try:
        if not isinstance(entry, FreeEntry):
            return Freedom.of_orientation()
        box = _three(entry.position or [0.0, 0.0, 0.0], "position")
        turning = [entry.rotation_about, entry.cone, entry.symmetry]
        if entry.orientation:
            if any(part is not None for part in turning):
                raise TaskError(
                    "'orientation' frees every rotation. Leave the other rotations out."
                )
            return Freedom.of_orientation(box)
        if entry.rotation_about is not None and entry.symmetry is not None:
            raise TaskError("'rotation_about' and 'symmetry' exclude each other. Keep one of them.")
        axes = [part if isinstance(part, list) else part.axis for part in turning if part]
        named = [_three(axis, "axis") for axis in axes]
        if any(axis != named[0] for axis in named[1:]):
            raise TaskError("the axes of 'cone', 'rotation_about' and 'symmetry' must be the same.")
        if entry.cone is not None and not 0.0 < entry.cone.half_angle_deg < 180.0:
            raise TaskError(
                f"field 'cone.half_angle_deg' is {entry.cone.half_angle_deg:g}, but must be above "
                "0 and below 180."
            )
        if entry.symmetry is not None and entry.symmetry.fold < 2:
            raise TaskError(
                f"field 'symmetry.fold' is {entry.symmetry.fold}, but must be 2 or more."
            )
        return Freedom(
            axis=named[0] if named else (1.0, 0.0, 0.0),
            rotates=entry.rotation_about is not None,
            fold=1 if entry.symmetry is None else entry.symmetry.fold,
            tilt=0.0 if entry.cone is None else math.radians(entry.cone.half_angle_deg),
            box=box,
        )
    except TaskError as error:
        raise TaskError(f"field 'free': {error}") from None


def _three(numbers: list[float], field: str) -> tuple[float, float, float]:
    """Return three numbers."""
    if len(numbers) != 3:
        raise TaskError(f"'{field}' is {numbers}, but must be [x, y, z].")
    x, y, z = numbers
    return x, y, z


def _keep_out(number: int, entry: KeepOutEntry) -> KeepOut:
    """Return a box that paths keep out of."""
    for name in ("position", "box"):
        if len(getattr(entry, name)) != 3:
            raise TaskError(f"field 'keep_out[{number}].{name}' must be [x, y, z].")
    (x, y, z), (length, width, height) = entry.position, entry.box
    try:
        return KeepOut(entry.body_frame, (x, y, z), (length, width, height))
    except TaskError as error:
        raise TaskError(f"field 'keep_out[{number}]': {error}") from None


def _line(entry: LineEntry | None, field: str) -> ToolLine | None:
    """Return a straight motion, None if the file names none."""
    if entry is None:
        return None
    if len(entry.direction) != 3:
        raise TaskError(f"field '{field}.direction' is {entry.direction}, but must be [x, y, z].")
    x, y, z = entry.direction
    try:
        return ToolLine((x, y, z), entry.distance)
    except TaskError as error:
        raise TaskError(f"field '{field}': {error}") from None
