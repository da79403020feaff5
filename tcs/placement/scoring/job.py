"""The scoring job: one task in one environment with one robot, loaded and checked."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypedDict, Unpack

from tcs.errors import TaskError, UnknownNameError
from tcs.files.paths import data_reference
from tcs.model.grid import Axis, Grid, restricted
from tcs.model.people import PersonLike
from tcs.model.robots import (
    RobotFile,
    arm_references,
    beside,
    links_of_arm,
    load_robot,
    load_tool,
    robot_of_hand,
    tool_names,
)
from tcs.model.scene import (
    EnvironmentFile,
    LoweredScene,
    Scene,
    SceneSpec,
    environment_names,
    goals_on_person,
    load_environment,
    lower,
    with_person,
    with_surface_goals,
    without_bodies,
)
from tcs.model.scene.environment.environment_file import Obstacle as EnvironmentObstacle
from tcs.model.tasks import Hand, Task, load_task
from tcs.placement.constraints import Constraints, Obstacle, kept_conditions

_NO_CONSTRAINTS = Constraints()
BARE = Hand()
"""The hand of goals that name neither arm nor tool."""


class JobOptions(TypedDict, total=False):
    """What of a scene is scored, and with whom."""

    only: Sequence[str]
    """Conditions on axes of the grid, e.g. "head_rest >= 35 deg"; other values are not scored."""
    constraints: Constraints
    """Further conditions, axes that keep their present value, forbidden regions and obstacles.
    Preferences have no effect."""
    now: Mapping[str, float] | None
    """Present values of axes [m or rad], for the axes to keep."""
    person: PersonLike | None
    """Whose body the person has, as for `tcs.model.people.load_person`; by default that of the
    environment file. Goals on the person are moved to that body."""
    arms: str | None
    """Arm of goals that name none: one of the robot's, "both" for any of them, or None for the one
    that the robot file describes."""
    paper: bool
    """Whether each goal is its own pose alone, as in the papers; by default what the task lets
    free serves as well."""


@dataclasses.dataclass(frozen=True)
class Job:
    """A task, a scene and a grid to score, before anything is built."""

    task: Task
    spec: SceneSpec
    grid: Grid
    """The configurations to choose from."""
    given_robot: RobotFile
    """The robot as it was given, without the hand that the goals name."""
    observed: tuple[Axis, ...] = ()
    """The axes that can only be observed; each of their states is scored into tables of its own."""
    constraints: Constraints = _NO_CONSTRAINTS
    """Constraints whose conditions and obstacles are part of `grid` and `spec` already; forbidden
    regions are applied when scoring."""
    hand: Hand = BARE
    """The arm and the tool that the goals name."""
    goal_numbers: tuple[int, ...] = ()
    """Numbers of the goals in a task whose goals name several hands; () for a whole task."""
    other_joints: tuple[str, ...] = ()
    """Joints of the arm that works at the same time, which the scores of this one leave out."""
    any_arm: bool = False
    """Whether goals that name no arm may be reached by any."""
    paper: bool = False
    """Whether the task is the exact one, scored as in the papers."""

    @property
    def scored_grid(self) -> Grid:
        """The grid once for each observed state, in C order."""
        return Grid((*self.observed, *self.grid.axes))

    @property
    def tables(self) -> int:
        """Number of observed states."""
        return math.prod(axis.count for axis in self.observed)

    def scene(self, *, meshes: bool = False) -> Scene:
        """Return a new live scene that allows the contacts this task allows.

        Args:
            meshes: Whether to load the robot's visual meshes, for display; this takes seconds.
        """
        return Scene(self.spec, allowed_contacts=self.task.allowed_contacts, meshes=meshes)

    def lowered(self, scene: Scene) -> LoweredScene:
        """Return the scene as arrays, without an arm that works at the same time."""
        lowered = lower(scene, self.task, self.scored_grid)
        if not self.other_joints:
            return lowered
        return without_bodies(lowered, links_of_arm(self.spec.robot, self.other_joints[0]))


def whole_task(jobs: Sequence[Job]) -> Task:
    """Return the task whose goals are those of jobs, the job of each hand."""
    if len(jobs) == 1:
        return jobs[0].task
    goals = {
        number: goal
        for job in jobs
        for number, goal in zip(job.goal_numbers, job.task.goals, strict=True)
    }
    contacts = (pair for job in jobs for pair in job.task.allowed_contacts)
    walls = (one for job in jobs for one in job.task.keep_out)
    return dataclasses.replace(
        jobs[0].task,
        goals=tuple(goals[number] for number in sorted(goals)),
        allowed_contacts=tuple(dict.fromkeys(contacts)),
        keep_out=tuple(dict.fromkeys(walls)),
    )


def load_job(
    task: str | Path | Task,
    environment: str | Path | EnvironmentFile,
    robot: str | Path | RobotFile,
    **options: Unpack[JobOptions],
) -> Job:
    """Load a task, an environment and a robot, check them against each other and return their job.

    Args:
        task: Name of a task, path of a task file, or a task.
        environment: Name of an environment, path of its file, or an environment.
        robot: Name of a robot, path of its file, or a robot.
        **options: See `JobOptions`.

    Raises:
        TaskError: If the goals of the task name several hands.
        TcsError: As `load_jobs`.
    """
    jobs = load_jobs(task, environment, robot, **options)
    if len(jobs) > 1:
        raise TaskError(
            f"This needs goals of one hand, but those of task '{jobs[0].task.name}' are of "
            f"{len(jobs)}: {'; '.join(str(job.hand) for job in jobs)}. Score the whole task with "
            "`tcs score`, or write a task of the goals of one hand."
        )
    return jobs[0]


def load_jobs(
    task: str | Path | Task,
    environment: str | Path | EnvironmentFile,
    robot: str | Path | RobotFile,
    **options: Unpack[JobOptions],
) -> tuple[Job, ...]:
    """Return the job of each hand that the goals of a task allow, one if they name none.

    Args:
        task: Name of a task, path of a task file, or a task.
        environment: Name of an environment, path of its file, or an environment.
        robot: Name of a robot, path of its file, or a robot.
        **options: See `JobOptions`.

    Raises:
        UnknownNameError: If a task, environment, robot, arm, tool, axis or body measure of that
            name does not exist.
        DataFileError: If a file cannot be used, or the task is not for that environment.
        RobotError: If goals or the options name an arm of a robot without several.
        GridError: If the grid is empty or enormous, or a condition is invalid.
        SelectionError: If the present value of an axis to keep is missing or not scored.
    """
    task = task if isinstance(task, Task) else load_task(task)
    paper = options.get("paper", False)
    if paper:
        task = task.exact()
    if not isinstance(environment, EnvironmentFile):
        environment = load_environment(environment)
    person = options.get("person")
    if person is not None:
        environment = with_person(environment, person)
    arms = options.get("arms")
    own = () if arms is None else tuple(arm_references(robot, arms))
    if len(own) == 1:
        robot, own = arm_references(robot, own[0])[own[0]], ()
    given = robot if isinstance(robot, RobotFile) else load_robot(robot)
    # An environment of the user's own may take any task whose body frames it has.
    is_shipped = environment.name in environment_names()
    if is_shipped and environment.name not in task.environments:
        raise TaskError(
            f"Task '{task.name}' has no goals in environment '{environment.name}'. "
            f"It is for: {', '.join(task.environments)}."
        )
    task = with_surface_goals(goals_on_person(task, environment), environment)
    by_hand = _with_any_arm(task.goals_by_hand(), own)
    constraints = options.get("constraints", _NO_CONSTRAINTS)
    around = with_obstacles(environment, constraints.blocked)
    jobs = []
    for hand, numbers in by_hand.items():
        held, other_joints = given, tuple[str, ...]()
        if hand != BARE:
            where = f"task '{task.name}', goals[{numbers[0]}]"
            held, other_joints = _robot_of(task, robot, hand, where)
        grid, applied = _restricted_grid(task, environment, held, options)
        jobs.append(
            Job(
                task=task if len(by_hand) == 1 else _of_hand(task, numbers, held),
                spec=SceneSpec(held, around),
                grid=grid,
                given_robot=given,
                observed=environment.observed_axes,
                constraints=applied,
                hand=hand,
                goal_numbers=() if len(by_hand) == 1 else numbers,
                other_joints=other_joints,
                any_arm=bool(own),
                paper=paper,
            )
        )
    return tuple(jobs)


def _with_any_arm(
    goals: Mapping[Hand, tuple[int, ...]], arms: Sequence[str]
) -> dict[Hand, tuple[int, ...]]:
    """Return the goals of each hand where those that name no arm may be reached by any of some."""
    found: dict[Hand, set[int]] = {}
    for hand, numbers in goals.items():
        any_arm = arms if not hand.arm and arms else (hand.arm,)
        for arm in any_arm:
            found.setdefault(dataclasses.replace(hand, arm=arm), set()).update(numbers)
    return {hand: tuple(sorted(numbers)) for hand, numbers in found.items()}


def _restricted_grid(
    task: Task, environment: EnvironmentFile, robot: RobotFile, options: JobOptions
) -> tuple[Grid, Constraints]:
    """Return the grid of a job, and its constraints with the conditions that are applied to it."""
    grid = Grid.from_spec(environment.grid, where=f"environment '{environment.name}'")
    changes = task.grid_changes(environment.name)
    if changes:
        grid = grid.overridden(changes, where=f"task '{task.name}'")
    if robot.torso_joint is None:
        # Without a torso joint all torso levels are the same configuration.
        grid = grid.overridden({"torso": {"start": 0.0, "count": 1}}, where=f"robot '{robot.name}'")
    constraints = options.get("constraints", _NO_CONSTRAINTS)
    kept = kept_conditions(constraints.keep, options.get("now") or {}, grid)
    conditions = (*options.get("only", ()), *constraints.only, *kept)
    applied = dataclasses.replace(constraints, only=conditions, keep=())
    return restricted(grid, conditions), applied


def _robot_of(
    task: Task, robot: str | Path | RobotFile, hand: Hand, where: str
) -> tuple[RobotFile, tuple[str, ...]]:
    """Return the robot of a hand, and the joints of the arm that works at the same time.

    Raises:
        UnknownNameError: If the task has no tool of that name, and none ships, or the robot has no
            such arm.
        RobotError: If the robot names no arms.
    """
    known = {**{name: name for name in tool_names()}, **task.tools}
    robots = []
    for arm, tool in ((hand.arm, hand.tool), *([hand.other] if hand.other else [])):
        if tool and tool not in known:
            raise UnknownNameError("tool", tool, known, where=where)
        robots.append(robot_of_hand(robot, arm, known.get(tool, ""), where=where))
    if hand.other is None:
        return robots[0], ()
    return beside(*robots), robots[1].arm_joints


def _of_hand(task: Task, numbers: Sequence[int], robot: RobotFile) -> Task:
    """Return some goals of a task as a task, with the contacts that its robot can make."""
    tools = {task.tools.get(goal.tool, goal.tool) for goal in task.goals if goal.tool}
    elsewhere = {load_tool(tool).name for tool in tools} - {body.name for body in robot.bodies}
    goals = tuple(task.goals[number] for number in numbers)
    frames = {pose.body_frame for goal in goals for pose in goal.poses}
    return dataclasses.replace(
        task,
        goals=goals,
        allowed_contacts=tuple(p for p in task.allowed_contacts if p[0] not in elsewhere),
        keep_out=tuple(one for one in task.keep_out if one.body_frame in frames),
    )


def data_references(job: Job, task: object, environment: object, robot: object) -> dict[str, Any]:
    """Return the metadata that locates a job's data files, given the arguments of `load_job`.

    Returns:
        `task`, `environment` and `robot` as of `data_reference`, and under `given` the same as the
        caller wrote them.
    """
    loaded = {
        "task": (task, job.task.name),
        "environment": (environment, job.spec.environment.name),
        "robot": (robot, job.given_robot.name),
    }
    return {
        **{key: data_reference(given, name) for key, (given, name) in loaded.items()},
        "given": {
            key: str(given) if isinstance(given, str | Path) else name
            for key, (given, name) in loaded.items()
        },
    }


def with_obstacles(environment: EnvironmentFile, blocked: Sequence[Obstacle]) -> EnvironmentFile:
    """Return an environment with boxes among its obstacles, named blocked_1, blocked_2 and so on.

    Args:
        environment: The environment.
        blocked: The boxes, in the environment frame.
    """
    taken = {entry.name for entry in environment.placed}
    names = (name for i in itertools.count(1) if (name := f"blocked_{i}") not in taken)
    added = tuple(
        EnvironmentObstacle(
            name=name,
            xyz=(box.x, box.y, float(box.centre[2])),
            rpy_deg=(0.0, 0.0, math.degrees(box.yaw)),
            box=(box.width, box.depth, box.z_high - box.z_low),
        )
        for name, box in zip(names, blocked, strict=False)
    )
    return environment.model_copy(update={"obstacles": (*environment.obstacles, *added)})
