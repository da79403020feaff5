"""Live scoring: the scene as it is observed, instead of the nearest stored state."""

from __future__ import annotations

import dataclasses
import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

from tcs.files.blocks import BlockFolder
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.problem import build_problem
from tcs.model.grid import Axis, Grid, thinned
from tcs.model.people import PersonLike
from tcs.model.robots import RobotFile
from tcs.model.scene import EnvironmentFile, Observation, estimate_joints
from tcs.model.tasks import Task
from tcs.placement.constraints import Constraints
from tcs.placement.scoring.approaches import ApproachScorer, approach_lines
from tcs.placement.scoring.dry_run import Estimate, estimate
from tcs.placement.scoring.engines import ScoringEngine
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.offline import (
    NO_CONSTRAINTS,
    ScoringSetup,
    load_setups,
    score_setups,
)
from tcs.placement.scoring.sets import SetOptions
from tcs.placement.store import ScoreFile

ObservationLike = Observation | Mapping[str, float]
"""An observation, or observed joint values alone [m or rad]."""


class LiveScorer:
    """Scores one task in one environment with one robot, once for each observation.

    Building the scene and compiling are done once; each observation then takes the time of the
    scoring alone. Several threads may ask at once: their observations are scored one after the
    other, each with `jobs` threads, for all share one scene.
    """

    def __init__(
        self,
        task: str | Path | Task,
        environment: str | Path | EnvironmentFile = "wheelchair",
        robot: str | Path | RobotFile = "pr2",
        *,
        measure: str = DEFAULT_MEASURE,
        jobs: int = 2,
        on_compile: Callable[[], None] | None = None,
        only: Sequence[str] = (),
        constraints: Constraints = NO_CONSTRAINTS,
        now: Mapping[str, float] | None = None,
        person: PersonLike | None = None,
        approach: bool | None = None,
        paper: bool = False,
        arms: str | None = None,
        **sets: Unpack[SetOptions],
    ) -> None:
        """Load the models, build the scene and compile the kernel.

        Args:
            task: As for `tcs.score`; so are `environment`, `robot`, `measure`, `jobs` and
                `sets`.
            environment: Environment.
            robot: Robot.
            measure: Dexterity measure.
            jobs: Number of threads.
            on_compile: Called before the kernel compiles, if it has to.
            only: Conditions on axes of the grid.
            constraints: As for `tcs.score`.
            now: Present values of axes [m or rad], for the axes that the constraints keep.
            person: Whose body the person has, as for `tcs.score`.
            approach: As for `tcs.score`.
            paper: As for `tcs.score`.
            arms: As for `tcs.score`.
            **sets: Options of the kept sets.

        Raises:
            TcsError: The errors of `tcs.score`.
        """
        self._setups = load_setups(
            task, environment, robot, measure=measure, jobs=jobs, sets=sets, only=only,
            constraints=constraints, now=now, person=person, approach=approach, arms=arms,
            paper=paper,
        )  # fmt: skip
        self._scene_in_use = threading.Lock()
        for setup in self._setups:
            lowered = _job_at(setup, {}).lowered(setup.scene)
            problem = build_problem(lowered.arrays, measure)
            is_scored = setup.approach.is_scored
            scorer = ApproachScorer(problem, approach_lines(setup.job)) if is_scored else None
            warm_up(problem, on_compile, scorer)

    @property
    def job(self) -> Job:
        """The job of the first hand, with the observed states that `tcs.score` would score."""
        return self._setups[0].job

    def score(
        self,
        observation: ObservationLike | None = None,
        *,
        every: int = 1,
        around: tuple[float, float] | None = None,
        blocks: BlockFolder | None = None,
        engine: ScoringEngine | None = None,
        on_progress: Callable[[int, int], None] | None = None,
    ) -> ScoreFile:
        """Score the scene as it is observed.

        Args:
            observation: The observed environment; by default its nominal state.
            every: Score only every so many base positions along x and along y, for a first answer.
            around: x and y [m] of a base position whose nearest one of the grid is among those.
            blocks: As for `tcs.score`; so are `engine` and `on_progress`.
            engine: Who scores.
            on_progress: Called with the number of scored configurations and their total.

        Returns:
            Scores and sets of the one observed state, for every function that takes a score file.
            The entry `observation` of its metadata holds the observed frames, the joint values
            fitted to them, and the error of the frames in the scored scene.

        Raises:
            UnknownNameError: If a joint or frame does not exist.
            SelectionError: If a joint is an axis of the grid, no state of the scene is near enough
                to the observed frames, or `around` is given without `every`.
            TcsError: If a joint follows another joint, or a value is beyond its limits.
        """
        begun = time.perf_counter()
        grid = thinned(self.job.grid, every, around)
        with self._scene_in_use:
            setups, entry = self._observed(observation, grid, blocks=blocks, engine=engine)
            return score_setups(
                setups, begun=begun, metadata={"observation": entry}, on_progress=on_progress
            )

    def estimate(self, observation: ObservationLike | None = None) -> Estimate:
        """Estimate what scoring the scene as it is observed would take.

        Args:
            observation: As for `score`.

        Raises:
            TcsError: The errors of `score`.
        """
        with self._scene_in_use:
            return estimate(self._observed(observation, self.job.grid)[0])

    def _observed(
        self, observation: ObservationLike | None, grid: Grid, **work: Any
    ) -> tuple[list[ScoringSetup], dict[str, Any]]:
        """Return the setups for the base poses of a grid in the scene as it is observed.

        Also the entry `observation` of the metadata. The caller is the only user of the scene.
        """
        if not isinstance(observation, Observation):
            observation = Observation(joints=dict(observation or {}))
        grid_axes = [axis.name for axis in self.job.grid.environment_axes]
        found = estimate_joints(self._setups[0].scene, observation, grid_axes)
        entry = {
            "joints": {name: float(value) for name, value in found.joints.items()},
            "frames": {name: [float(x) for x in at] for name, at in observation.frames.items()},
            "frame_position_error": found.position_error,
            "frame_rotation_error": found.rotation_error,
        }
        setups = [
            dataclasses.replace(
                setup, job=dataclasses.replace(_job_at(setup, found.joints), grid=grid), **work
            )
            for setup in self._setups
        ]
        return setups, entry


def _job_at(setup: ScoringSetup, joints: Mapping[str, float]) -> Job:
    """Return the job with the one observed state of these joint values; others are 0."""
    joints = {**{axis.name: 0.0 for axis in setup.job.observed}, **joints}
    axes = []
    for name, value in joints.items():
        is_angle = setup.scene.built.environment_joints.is_revolute(name)
        start = math.degrees(value) if is_angle else value
        axes.append(Axis(name, "deg" if is_angle else "m", start, 0.0, 1))
    return dataclasses.replace(setup.job, observed=tuple(axes))


def score_observed(
    task: str | Path | Task,
    environment: str | Path | EnvironmentFile = "wheelchair",
    robot: str | Path | RobotFile = "pr2",
    *,
    observation: ObservationLike | None = None,
    measure: str = DEFAULT_MEASURE,
    jobs: int = 2,
    constraints: Constraints = NO_CONSTRAINTS,
    now: Mapping[str, float] | None = None,
    person: PersonLike | None = None,
    approach: bool | None = None,
    paper: bool = False,
    arms: str | None = None,
    **sets: Unpack[SetOptions],
) -> ScoreFile:
    """Score a task in the scene as it is observed, on the whole grid of the environment.

    For more than one observation use `LiveScorer`: building the scene takes longer than scoring.

    Args:
        task: As for `tcs.score`; so are `environment`, `robot`, `measure`, `jobs` and `sets`.
        environment: Environment.
        robot: Robot.
        observation: The observed environment: an `Observation`, or values of its joints [m or rad].
        measure: Dexterity measure.
        jobs: Number of threads.
        constraints: As for `tcs.score`.
        now: Present values of axes [m or rad], for the axes that the constraints keep.
        person: Whose body the person has, as for `tcs.score`.
        approach: As for `tcs.score`.
        paper: As for `tcs.score`.
        arms: As for `tcs.score`.
        **sets: Options of the kept sets.

    Returns:
        Scores and sets of the one observed state, as `LiveScorer.score` returns them.

    Raises:
        TcsError: The errors of `LiveScorer` and `LiveScorer.score`.
    """
    scorer = LiveScorer(
        task, environment, robot, measure=measure, jobs=jobs, constraints=constraints, now=now,
        person=person, approach=approach, paper=paper, arms=arms, **sets,
    )  # fmt: skip
    return scorer.score(observation)
