"""A stop: one initial configuration, prepared for motions of the arm and for their re-check."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.motion.connect import Trees, new_trees
from tcs.kernel.motion.edges import NO_PAIR, posture_contact
from tcs.kernel.motion.scene import (
    MotionScene,
    MotionWorkspace,
    motion_scene,
    new_motion_workspace,
)
from tcs.kernel.problem import Problem, build_problem
from tcs.model.grid import Axis, Grid, InitialConfiguration
from tcs.model.scene import LoweredScene, Scene, lower
from tcs.placement.scoring.job import Job

BodyPair = tuple[str, str]
"""Names of two bodies: one of the robot, then the other."""


@dataclass(frozen=True, eq=False)
class Stop:
    """One initial configuration of a job, with the memory of one planner."""

    job: Job
    scene: Scene
    """The live scene, in the state of this stop."""
    at: InitialConfiguration
    lowered: LoweredScene
    problem: Problem
    motion: MotionScene
    work: MotionWorkspace
    trees: Trees
    rest: FloatArray
    """Rest posture of the arm [rad], shape (7,)."""
    velocity: FloatArray
    """Velocity limits [rad/s], shape (7,)."""
    acceleration: FloatArray
    """Acceleration limits [rad/s^2], shape (7,)."""

    @classmethod
    def of(cls, job: Job, scene: Scene, configuration: int, seed: int) -> Stop:
        """Prepare an initial configuration.

        Args:
            job: Task, robot, environment and grid.
            scene: The job's live scene; set to the configuration.
            configuration: Flat index in the job's scored grid.
            seed: Seed of the planner.

        Raises:
            RobotError: If a velocity limit is unknown.
        """
        axes = job.scored_grid.axes
        values = job.scored_grid.values(np.array([configuration]))
        single = []
        for axis in axes:
            value = float(values[axis.name][0])
            start = math.degrees(value) if axis.unit == "deg" else value
            single.append(Axis(axis.name, axis.unit, start, 0.0, 1))
        grid = Grid(tuple(single))
        lowered = lower(scene, job.task, grid)
        problem = build_problem(lowered.arrays, lowered.grid)
        motion = motion_scene(problem, 0)
        velocity, acceleration = job.spec.robot.arm_rates()
        stop = cls(
            job=job,
            scene=scene,
            at=grid.configuration(0),
            lowered=lowered,
            problem=problem,
            motion=motion,
            work=new_motion_workspace(motion),
            trees=new_trees(seed),
            rest=np.array(job.spec.robot.arm_rest()),
            velocity=np.array(velocity),
            acceleration=np.array(acceleration),
        )
        stop.place({name: float(value[0]) for name, value in values.items()})
        return stop

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
        return None if pair == NO_PAIR else self.bodies(pair)

    def bodies(self, pair: int) -> BodyPair:
        """Return the names of the bodies of a pair of shapes."""
        first, second = (self._body(int(self.motion.body[i])) for i in self.motion.pair[pair, :2])
        return first, second

    def _body(self, number: int) -> str:
        environment = self.problem.environment_bodies
        if number < environment:
            return self.lowered.environment_bodies[number]
        return self.lowered.robot_bodies[number - environment]

    def forget_contacts(self) -> None:
        """Start counting anew which pairs block edges."""
        self.work.hits[:] = 0

    def most_frequent_contact(self) -> BodyPair | None:
        """Return the pair of bodies that blocked most edges since `forget_contacts`."""
        counts: dict[BodyPair, int] = {}
        for pair in np.flatnonzero(self.work.hits):
            names = self.bodies(int(pair))
            counts[names] = counts.get(names, 0) + int(self.work.hits[pair])
        return max(counts, key=lambda names: counts[names], default=None)

    def rest_contact(self) -> BodyPair | None:
        """Return two bodies in contact while the arm rests, None if nothing touches."""
        found = self.scene.violations()
        return found[0][:2] if found else self.contact_at(self.rest)
