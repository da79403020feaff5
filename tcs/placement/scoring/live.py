"""Score a scene as it is observed, now, in place of taking the nearest state that is stored."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Unpack

from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.problem import build_problem
from tcs.model.grid import Axis
from tcs.model.robots import RobotFile
from tcs.model.scene import EnvironmentFile, Observation, find_joints
from tcs.model.tasks import Task
from tcs.placement.scoring.job import Job, load_job, references, score_scene
from tcs.placement.scoring.sets import SetOptions, checked_options
from tcs.placement.scoring.sweep import warm_up
from tcs.placement.store import ScoreFile

Seen = Observation | Mapping[str, float]
"""An observation, or just values of joints [m or rad]."""


class LiveScorer:
    """One task in one environment with one robot, kept ready to be scored as it is observed.

    Scene and machine code are made ready once; each observation then costs the scoring alone. Not
    to be used by two threads at a time: it has one scene.
    """

    def __init__(
        self,
        task: str | Path | Task,
        robot: str | Path | RobotFile = "pr2",
        *,
        environment: str | Path | EnvironmentFile = "wheelchair",
        measure: str = DEFAULT_MEASURE,
        jobs: int = 2,
        on_compile: Callable[[], None] | None = None,
        **sets: Unpack[SetOptions],
    ) -> None:
        """Load everything, build the scene and have the kernel's machine code at hand.

        Args:
            task: Name of a task, path of a task file, or a task.
            robot: Name, path or robot.
            environment: Name, path or environment.
            measure: Name of the dexterity measure, see `tcs.score`.
            jobs: Number of threads; the result does not depend on it.
            on_compile: Called before the kernel compiles, when it has to.
            **sets: Which sets are kept, see `tcs.placement.scoring.SetOptions`.

        Raises:
            UnknownNameError: If a task, environment, robot, frame or measure of that name does not
                exist.
            DataFileError: If a file cannot be used.
            GridError: If the grid is empty or enormous.
            TcsError: If an option of the sets is out of range.
        """
        self._sets = checked_options(**sets)
        self._job = load_job(task, environment, robot)
        self._named = references(self._job, task, environment, robot)
        self._scene = self._job.scene()
        self._measure = measure
        self._jobs = jobs
        lowered = self._job_at({}).lowered(self._scene)
        warm_up(build_problem(lowered.arrays, lowered.grid, measure), on_compile)

    @property
    def job(self) -> Job:
        """What is scored, with the observed states that would be scored offline."""
        return self._job

    def score(self, observation: Seen | None = None) -> ScoreFile:
        """Score the scene as it is observed.

        Args:
            observation: How the room is found; by default where everything belongs.

        Returns:
            Scores and sets with the one observed state, for `tcs.select`, `tcs.verify` and all
            that takes a score file. Its metadata tell under `observation` what was seen, and how
            far the frames seen are from the scene that was scored.

        Raises:
            UnknownNameError: If a joint or frame is not there.
            SelectionError: If a joint is chosen and not found, or what is seen is too far from
                what the scene can do.
            TcsError: If a joint follows another one, or does not go that far.
        """
        begun = time.perf_counter()
        if not isinstance(observation, Observation):
            observation = Observation(joints=dict(observation or {}))
        chosen = [axis.name for axis in self._job.grid.environment_axes]
        found = find_joints(self._scene, observation, chosen)
        told = {
            "joints": {name: float(value) for name, value in found.joints.items()},
            "frames": {name: [float(x) for x in at] for name, at in observation.frames.items()},
            "frames_off": found.off,
            "frames_turned": found.turned,
        }
        return score_scene(
            self._job_at(found.joints),
            self._scene,
            self._sets,
            named={**self._named, "observation": told},
            measure=self._measure,
            begun=begun,
            jobs=self._jobs,
        )

    def _job_at(self, joints: Mapping[str, float]) -> Job:
        """Return the job with the one observed state in which the joints are where they are."""
        untold = {axis.name: 0.0 for axis in self._job.observed}
        axes = []
        for name, value in {**untold, **joints}.items():
            turns = self._scene.built.environment_joints.turns(name)
            start = math.degrees(value) if turns else value
            axes.append(Axis(name, "deg" if turns else "m", start, 0.0, 1))
        return dataclasses.replace(self._job, observed=tuple(axes))


def score_observed(
    task: str | Path | Task,
    robot: str | Path | RobotFile = "pr2",
    observation: Seen | None = None,
    *,
    environment: str | Path | EnvironmentFile = "wheelchair",
    measure: str = DEFAULT_MEASURE,
    jobs: int = 2,
    **sets: Unpack[SetOptions],
) -> ScoreFile:
    """Score a task in the scene as it is observed, on the whole grid of the environment.

    To score more than once, keep a `LiveScorer`: building the scene takes longer than scoring it.

    Args:
        task: Name of a task, path of a task file, or a task.
        robot: Name, path or robot.
        observation: How the room is found: an `Observation`, or values of its joints [m or rad].
        environment: Name, path or environment.
        measure: Name of the dexterity measure, see `tcs.score`.
        jobs: Number of threads; the result does not depend on it.
        **sets: Which sets are kept, see `tcs.placement.scoring.SetOptions`.

    Returns:
        Scores and sets with the one observed state, as `LiveScorer.score`.

    Raises:
        TcsError: Whatever `LiveScorer` and its `score` raise.
    """
    scorer = LiveScorer(task, robot, environment=environment, measure=measure, jobs=jobs, **sets)
    return scorer.score(observation)
