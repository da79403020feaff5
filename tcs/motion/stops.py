"""A stop: one initial configuration, prepared for motions of the arm and for their re-check."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tcs.errors import TaskError
from tcs.kernel.analytic.solver import is_outside
from tcs.kernel.approach.regions import RegionPoses, is_region, region_poses
from tcs.kernel.approach.scene import LineScene, approach_scene
from tcs.kernel.approach.sweep import ApproachLines
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.motion.box_trees import grouped
from tcs.kernel.motion.edges import posture_contact
from tcs.kernel.motion.never_in_contact import needed_pairs
from tcs.kernel.motion.scene import (
    NO_PAIR,
    MotionScene,
    MotionWorkspace,
    arm_base,
    carriers,
    goal_from_arm_base,
    new_motion_workspace,
    placed,
    torso_scene,
    with_pairs,
)
from tcs.kernel.motion.search_trees import Trees, new_trees
from tcs.kernel.postures import tool_poses
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows, rows_at
from tcs.model.grid import Axis, Grid, InitialConfiguration
from tcs.model.scene import LoweredScene, Scene, lower
from tcs.motion.curves import CHAIN, in_chain
from tcs.motion.free_goals import ScoredPostures
from tcs.motion.keep_out import with_keep_out
from tcs.placement.scoring.approaches import approach_lines
from tcs.placement.scoring.job import Job

BodyPair = tuple[str, str]
"""Names of two bodies: one of the robot, then the other."""


def single_grid(axes: Sequence[Axis], values: Sequence[float]) -> Grid:
    """Return the grid of one configuration.

    Args:
        axes: The axes.
        values: Value of each [m or rad].
    """
    return Grid(single_axes(axes, values))


def single_axes(axes: Sequence[Axis], values: Sequence[float]) -> tuple[Axis, ...]:
    """Return axes with a single value each [m or rad]."""
    single = []
    for axis, value in zip(axes, values, strict=True):
        start = math.degrees(value) if axis.unit == "deg" else value
        single.append(Axis(axis.name, axis.unit, start, 0.0, 1))
    return tuple(single)


@dataclass(frozen=True, eq=False)
class StopGrid:
    """Initial configurations of a job, lowered once for the stops at any of them."""

    job: Job
    scene: Scene
    """The job's live scene."""
    configurations: Grid
    lowered: LoweredScene
    """Scene and configurations as arrays, with the boxes that paths keep out of."""
    problem: Problem
    """The same as the kernel takes it."""
    rests: FloatArray
    """Rest postures of the arm [rad], in the order in which they are tried, shape (n, 7).

    As everywhere here, joints are those of the kernel's chain: the first ones, which an arm of
    fewer than seven lacks, remain at 0."""
    velocity: FloatArray
    """Velocity limits [rad/s], shape (7,)."""
    acceleration: FloatArray
    """Acceleration limits [rad/s^2], shape (7,)."""
    scored: ScoredPostures | None = None
    """Postures at which scoring reaches the goals; None if every goal is a single pose."""
    scenes: dict[int, tuple[MotionScene, MotionScene]] = field(default_factory=dict)
    """For each torso level met so far, the scenes of paths and of straight motions, with the
    environment in no particular place."""

    @classmethod
    def of(cls, job: Job, scene: Scene, grid: Grid, lowered: LoweredScene) -> StopGrid:
        """Prepare configurations.

        Args:
            job: Task, robot, environment and grid.
            scene: The job's live scene.
            grid: The configurations.
            lowered: Scene and configurations as arrays, without boxes that paths keep out of.

        Raises:
            RobotError: If a velocity limit is unknown.
            TaskError: If goals are reached by two arms at the same time.
        """
        if job.other_joints:
            raise TaskError(
                f"task '{job.task.name}' has goals that two arms reach at the same time, but one "
                "arm moves at a time. Leave 'together_with' out of the task to plan."
            )
        rates = np.array(job.spec.robot.arm_rates())
        # Those of joints that never move decide nothing.
        velocity, acceleration = in_chain(rates, 1.0)
        scored = None
        if job.task.has_freedom:
            scored = ScoredPostures(build_problem(lowered.arrays), approach_lines(job))
        if job.task.keep_out:
            lowered = with_keep_out(lowered, job.task)
        return cls(
            job=job,
            scene=scene,
            configurations=grid,
            lowered=lowered,
            problem=build_problem(lowered.arrays),
            rests=in_chain(np.array(list(job.spec.robot.rest_postures().values()))),
            velocity=velocity,
            acceleration=acceleration,
            scored=scored,
        )

    @cached_property
    def lines(self) -> ApproachLines:
        """The approaches of the goals."""
        return approach_lines(self.job)

    @cached_property
    def around(self) -> LineScene:
        """The shapes around the straight motions, which take a tenth of a second to arrange."""
        return approach_scene(self.problem)

    @cached_property
    def regions(self) -> tuple[RegionPoses | None, ...]:
        """Some poses of the region of each goal; None of a goal that is a single pose."""
        several = is_region(self.problem)
        return tuple(
            region_poses(self.problem, number) if goal.region and several else None
            for number, goal in enumerate(self.job.task.goals)
        )

    def prepare(self) -> None:
        """Arrange what all stops share, which threads would arrange at the same time."""
        _ = self.lines, self.around, self.regions

    def stop(self, configuration: int, trees: Trees) -> Stop:
        """Return the stop at a configuration; the live scene stays as it is.

        Args:
            configuration: Flat index among those that are lowered.
            trees: Memory of the planner, with its random state.
        """
        row = rows_at(self.lowered.grid, [configuration])
        held = {} if self.scored is None else self.scored.at(row)
        return self.stop_at(row, trees, held, configuration)

    def stop_at(
        self, row: Rows, trees: Trees, held: Mapping[int, FloatArray], number: int = 0
    ) -> Stop:
        """Return the stop at an initial configuration; the live scene stays as it is.

        Args:
            row: The configuration, with the numbers of a state and a torso level that are lowered.
            trees: Memory of the planner, with its random state.
            held: Postures at which scoring reaches goals there [rad], shape (7,), by goal.
            number: Its flat index in `configurations`.
        """
        paths, straight = self.scenes_at(int(row.torso[0]))
        motion = placed(paths, self.problem, row)
        work = new_motion_workspace(motion)
        lines, line_work = motion, work
        if straight is not paths:
            lines = placed(straight, self.problem, row)
            line_work = new_motion_workspace(lines)
        return Stop(self, number, row, held, motion, work, lines, line_work, trees)

    def scenes_at(self, torso: int) -> tuple[MotionScene, MotionScene]:
        """Return the scenes of paths and of straight motions at a torso level, to be placed."""
        if torso not in self.scenes:
            self.scenes[torso] = self._scenes_at(torso)
        return self.scenes[torso]

    def _scenes_at(self, torso: int) -> tuple[MotionScene, MotionScene]:
        """Do as `scenes_at`; pairs of the robot's own shapes that never touch are left out."""
        every, robot = torso_scene(self.problem, torso), self.problem.environment.bodies
        other = every.shapes.body[every.pairs.members[:, 1]]
        kept = needed_pairs(every, other >= robot)
        of_fixed = carriers(self.problem)
        paths = grouped(with_pairs(every, kept), of_fixed)
        if not self.job.task.keep_out:
            return paths, paths
        # The boxes are the last bodies of the environment.
        outside = (other < robot - len(self.job.task.keep_out)) | (other >= robot)
        return paths, grouped(with_pairs(every, kept & outside), of_fixed)


@dataclass(frozen=True, eq=False)
class Stop:
    """One initial configuration of a job, with the memory of one planner."""

    grid: StopGrid
    number: int
    """Flat index of the configuration in `grid`."""
    row: Rows
    """The configuration."""
    held: Mapping[int, FloatArray]
    """Postures at which scoring reaches goals [rad], shape (7,), by goal; none if unknown."""
    motion: MotionScene
    """The scene of paths, with the boxes that they keep out of."""
    work: MotionWorkspace
    lines: MotionScene
    """The scene of straight motions to and from goals."""
    line_work: MotionWorkspace
    trees: Trees

    @classmethod
    def of(cls, job: Job, scene: Scene, configuration: int, seed: int) -> Stop:
        """Prepare an initial configuration, and set the live scene to it.

        Args:
            job: Task, robot, environment and grid.
            scene: The job's live scene.
            configuration: Flat index in the job's scored grid.
            seed: Seed of the planner.

        Raises:
            RobotError: If a velocity limit is unknown.
        """
        axes = job.scored_grid.axes
        values = job.scored_grid.values(np.array([configuration]))
        return cls.at_values(job, scene, [float(values[axis.name][0]) for axis in axes], seed)

    @classmethod
    def at_values(cls, job: Job, scene: Scene, values: Sequence[float], seed: int) -> Stop:
        """Prepare an initial configuration on or off the grid, and set the live scene to it.

        Args:
            job: Task, robot, environment and grid.
            scene: The job's live scene.
            values: Value of each axis of the job's scored grid [m or rad].
            seed: Seed of the planner.

        Raises:
            RobotError: If a velocity limit is unknown.
        """
        axes = job.scored_grid.axes
        grid = single_grid(axes, values)
        stops = StopGrid.of(job, scene, grid, lower(scene, job.task, grid))
        stop = stops.stop(0, new_trees(seed))
        stop.place({axis.name: value for axis, value in zip(axes, values, strict=True)})
        return stop

    @property
    def job(self) -> Job:
        """The job."""
        return self.grid.job

    @property
    def scene(self) -> Scene:
        """The live scene."""
        return self.grid.scene

    @property
    def problem(self) -> Problem:
        """The scene as arrays."""
        return self.grid.problem

    @cached_property
    def rest(self) -> FloatArray:
        """The first rest posture without contact, or the first of all if none is [rad], (7,)."""
        rests = self.grid.rests
        free = (q for q in rests if self.contact_at(q) is None)
        return rests[0] if len(rests) == 1 else next(free, rests[0])

    @property
    def is_sampled(self) -> bool:
        """Whether more angles of a free joint give more postures of the arm at a goal."""
        problem = self.grid.problem
        return problem.chain.joints == CHAIN and not is_outside(problem.arm)

    @property
    def joints(self) -> int:
        """Number of joints of the arm."""
        return self.grid.problem.chain.joints

    @property
    def velocity(self) -> FloatArray:
        """Velocity limits [rad/s], shape (7,)."""
        return self.grid.velocity

    @property
    def acceleration(self) -> FloatArray:
        """Acceleration limits [rad/s^2], shape (7,)."""
        return self.grid.acceleration

    @property
    def at(self) -> InitialConfiguration:
        """The initial configuration."""
        return self.grid.configurations.configuration(self.number)

    def goal_in_arm_base(self, goal: int) -> tuple[FloatArray, FloatArray]:
        """Return the pose of a goal in the arm base A: orientation (3, 3), position (3,) [m].

        Of a free goal it is the pose at which scoring reaches it, the nominal one if it does not.
        """
        if self.job.task.goals[goal].region and goal in self.held:
            R_AT, p_AT = np.empty((1, 3, 3)), np.empty((1, 3))
            chain = self.problem.chain
            tool_poses(chain.R, chain.p, self.held[goal][None], R_AT, p_AT)
            return R_AT[0], p_AT[0]
        return goal_from_arm_base(self.problem, self.row, goal)

    def region_in_arm_base(self, goal: int) -> list[tuple[FloatArray, FloatArray]]:
        """Return other poses of a goal's region in the arm base, as `goal_in_arm_base` does."""
        region = self.grid.regions[goal]
        if region is None:
            return []
        R_WA, p_WA = arm_base(self.problem, self.row)
        goals, state = self.problem.goals, self.row.state[0]
        R_WG, p_WG = goals.R[state, region.pose], goals.p[state, region.pose]
        R_AT = np.ascontiguousarray(R_WA.T @ R_WG @ region.R)
        p_AT = (p_WG + np.einsum("uij,uj->ui", R_WG, region.p) - p_WA) @ R_WA
        return list(zip(R_AT, p_AT, strict=True))

    def place(self, values: dict[str, float]) -> None:
        """Set the live scene to this stop, the arm to its rest posture.

        Args:
            values: Value of each axis of the grid [m or rad].
        """
        self.scene.place_base(values["base_x"], values["base_y"], values["base_yaw"])
        self.scene.set_torso(values["torso"])
        for axis in self.job.scored_grid.environment_axes:
            self.scene.set_joint(axis.name, values[axis.name])
        self.scene.set_arm(self.rest)

    def contact_at(self, q: FloatArray) -> BodyPair | None:
        """Return two bodies in contact at joint angles q, None if nothing touches."""
        pair = posture_contact(self.motion, self.work, q)
        return None if pair == NO_PAIR else self.bodies(self.motion, pair)

    def bodies(self, motion: MotionScene, pair: int) -> BodyPair:
        """Return the names of the bodies of a pair of shapes of one of the two scenes."""
        first, second = (
            self._names[int(motion.shapes.body[i])] for i in motion.pairs.members[pair, :2]
        )
        return first, second

    @property
    def _names(self) -> tuple[str, ...]:
        """Names of the bodies: robot bodies are numbered after those of the environment."""
        lowered = self.grid.lowered
        return *lowered.environment_bodies, *lowered.robot_bodies

    def forget_contacts(self) -> None:
        """Start counting anew which pairs block edges and straight motions."""
        self.work.contacts.hits[:] = self.line_work.contacts.hits[:] = 0

    def most_frequent_contact(self) -> BodyPair | None:
        """Return the pair of bodies that blocked most edges since `forget_contacts`."""
        return self.most_frequent(self.work.contacts.hits)

    def most_frequent(self, contacts: IntArray) -> BodyPair | None:
        """Return the pair of bodies with the most contacts, None if there are none.

        Args:
            contacts: Numbers of contacts, shape as that of `FoundContacts.hits`.
        """
        if not np.any(contacts):
            return None
        first, second = np.unravel_index(np.argmax(contacts), contacts.shape)
        return self._names[int(first)], self._names[int(second)]

    def rest_contact(self) -> BodyPair | None:
        """Return two bodies in contact while the arm rests, None if nothing touches."""
        found = self.resting_contacts()
        return found[0] if found else self.contact_at(self.rest)

    def resting_contacts(self) -> list[BodyPair]:
        """Return the bodies that Drake finds in contact in the live scene."""
        return [pair[:2] for pair in self.scene.violations()]
