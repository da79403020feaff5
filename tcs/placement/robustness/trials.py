"""Trials: which goals configurations of a score file reach in perturbed environments."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.errors import SelectionError, TcsError
from tcs.files.blocks import BlockFolder, Blocks, opened_if
from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import Rows
from tcs.model.grid import Grid
from tcs.model.scene import ErrorDistribution, LoweredScene, Scene, environment_at
from tcs.model.tasks import Task
from tcs.placement.robustness.body_collisions import (
    check_body_collisions,
    counted_pairs,
    counted_rests,
    default_collisions,
)
from tcs.placement.robustness.error_model import ErrorModel, Offsets, displaced, samples_of
from tcs.placement.robustness.kept_runs import kept_runs, states_digest, trials_key
from tcs.placement.robustness.perturbed_scenes import (
    BATCH,
    HandScenes,
    PerturbedScenes,
    Run,
    grippers_of,
)
from tcs.placement.scoring.approaches import ApproachScorer, approach_lines
from tcs.placement.scoring.hands import HandScores
from tcs.placement.scoring.job import Job, whole_task
from tcs.placement.scoring.kernel_start import KernelStart
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.scoring.together import Hands
from tcs.placement.store import APPROACH, ScoreFile, StateTables
from tcs.placement.tables import Reason

if TYPE_CHECKING:
    from tcs.kernel.approach.sweep import ApproachLines

CHUNK = 1000
"""Samples whose environments are held in memory together: some ten megabytes."""

KEPT_SCENES = 16
"""States of the environment that are kept with their samples, some ten megabytes each at most."""

Errors = str | Path | Mapping[str, ErrorDistribution] | None
"""Path of an error file, errors by joint, or None for the errors of the environment."""
Progress = Callable[[int, int], None] | None
"""Function called with the amounts of work done and in all."""


@dataclass(frozen=True, eq=False)
class HandTrials:
    """The robot with one hand, prepared for trials."""

    job: Job
    """The task with the goals of the hand, robot, environment and grid."""
    scene: Scene
    """The live scene."""
    lowered: LoweredScene
    """The scene as arrays."""
    body_pairs: BoolArray
    """The pairs of body and environment shapes whose collisions count, shape (n_body,
    n_environment)."""
    goals: tuple[int, ...]
    """Numbers of the goals that the hand may serve."""
    lines: ApproachLines | None = None
    """The approaches of the goals, if the file was scored with approach."""

    def scenes(
        self, positions: Mapping[str, FloatArray], measure: str, jobs: int = 1
    ) -> HandScenes:
        """Return the environment with its joints at each sample's positions, as arrays.

        Args:
            positions: Joint positions [m or rad], shapes (samples,).
            measure: Name of the dexterity measure.
            jobs: Number of threads.
        """
        arrays = environment_at(self.lowered, self.scene, self.job.task, _states(positions))
        arrays = arrays._replace(body_vs_environment=self.body_pairs)
        problem = build_problem(arrays, measure)
        scorer = Scorer(problem, grippers_of(problem, jobs), self.approaches)
        return HandScenes(scorer, self.goals)

    @cached_property
    def approaches(self) -> ApproachScorer | None:
        """Scores the approaches of the goals, whatever the state of the environment."""
        if self.lines is None:
            return None
        return ApproachScorer(build_problem(self.lowered.arrays), self.lines)

    def arrays_digest(self, positions: Mapping[str, FloatArray]) -> str:
        """Return the hash of the scene with its environment in other states.

        Args:
            positions: Joint positions in each state [m or rad], shapes (states,).
        """
        arrays = environment_at(self.lowered, self.scene, self.job.task, _states(positions))
        return dataclasses.replace(self.lowered, arrays=arrays).digest()


@dataclass(frozen=True, eq=False)
class Trials:
    """One table of a score file, prepared for evaluating its configurations under error.

    Construction builds Drake's plant, which takes half a second: keep the object to evaluate
    several sets.
    """

    file: ScoreFile
    """The score file."""
    table: int
    """Number of its table, which was scored for one observed state."""
    errors: ErrorModel
    """Error model of the environment."""
    body_collisions: str
    """Collisions of the robot's body that count, one of `BODY_COLLISIONS`."""
    hands: tuple[HandTrials, ...]
    """The robot with each hand."""
    start: KernelStart
    """The start of the kernel, which is put off until something has to be scored."""
    known_scenes: dict[str, PerturbedScenes] = field(default_factory=dict, repr=False)
    """States of the environment in samples that were evaluated last, by their hash."""
    blocks: Blocks | None = None
    """Where the goals that are reached are kept; None to keep none."""

    @classmethod
    def of(
        cls,
        file: ScoreFile,
        *,
        errors: Errors = None,
        table: int | None = None,
        body_collisions: str | None = None,
        on_compile: Callable[[], None] | None = None,
    ) -> Trials:
        """Return the trials of a score file.

        Args:
            file: A score file.
            errors: Path of an error file, or errors by joint, in place of those of the environment.
            table: Number of one of its tables; by default the nominal one.
            body_collisions: Collisions of the robot's body that count, one of `BODY_COLLISIONS`;
                None for those of `default_collisions`.
            on_compile: Called first if the kernel has to be compiled.

        Raises:
            StoreMismatchError: If the file was made from other models.
            DataFileError: If a file cannot be used.
            UnknownNameError: If a named model, joint or choice of collisions does not exist.
            SelectionError: If there is no such table.
        """
        if body_collisions is not None:
            check_body_collisions(body_collisions)
        built = rebuild_scenes(file)
        chosen = file.nominal_index if table is None else table
        if not 0 <= chosen < len(file.tables):
            raise SelectionError(
                f"There is no table {table}; the file has {len(file.tables)}, counted from 0."
            )
        measure = str(file.metadata["measure"])
        trials = cls.built(file, chosen, built, errors, body_collisions)
        start = KernelStart(
            lambda: (build_problem(lowered.arrays, measure) for *_, lowered in built),
            on_compile,
            trials.hands[0].approaches,
        )
        return dataclasses.replace(trials, start=start)

    @classmethod
    def built(
        cls,
        file: ScoreFile,
        table: int,
        built: Sequence[tuple[Job, Scene, LoweredScene]],
        errors: Errors = None,
        body_collisions: str | None = None,
    ) -> Trials:
        """Return the trials of a table whose scene is built, once for each hand, kernel started.

        Args:
            file: A score file.
            table: Number of its table.
            built: Job, scene and arrays of each hand.
            errors: As for `of`.
            body_collisions: As for `of`.
        """
        if body_collisions is None:
            body_collisions = default_collisions(file.metadata)
        hands = tuple(
            HandTrials(
                job,
                scene,
                counted_rests(lowered, body_collisions),
                counted_pairs(scene, lowered, body_collisions),
                goals,
                approach_lines(job) if APPROACH in file.metadata else None,
            )
            for (job, scene, lowered), goals in zip(built, file.goals_of_hands, strict=True)
        )
        errors_of = ErrorModel.of(built[0][1], errors)
        return cls(file, table, errors_of, body_collisions, hands, KernelStart(tuple))

    def at_table(self, table: int) -> Trials:
        """Return the trials of another table of the same file."""
        return dataclasses.replace(self, table=table)

    @contextmanager
    def kept_in(self, folder: BlockFolder | None) -> Iterator[Trials]:
        """Yield trials that keep the goals that are reached in a folder; themselves without one.

        Raises:
            OutputError: If the folder cannot be made, or another process is at work there.
        """
        with opened_if(folder, lambda: self.key) as blocks:
            yield dataclasses.replace(self, blocks=blocks) if blocks is not None else self

    @property
    def compile_seconds(self) -> float:
        """Time that compiling the kernel, or loading its machine code, has taken so far [s]."""
        return self.start.seconds

    @property
    def key(self) -> str:
        """Hash of what the trials of all tables follow from, but for the errors."""
        hands = ((hand.lowered, hand.body_pairs, hand.lines) for hand in self.hands)
        return trials_key(hands, self.measure)

    @property
    def with_approach(self) -> bool:
        """Whether a goal counts as reached only by postures that can be approached."""
        return self.hands[0].lines is not None

    @property
    def scored(self) -> StateTables:
        """Scores and sets of the table."""
        return self.file.tables[self.table]

    @cached_property
    def together(self) -> Hands:
        """The hands, to check arms that work at the same time against each other."""
        return Hands.of([(hand.job, hand.lowered) for hand in self.hands], self.measure)

    @cached_property
    def task(self) -> Task:
        """The scored task, with the goals of all hands."""
        return whole_task([hand.job for hand in self.hands])

    @property
    def job(self) -> Job:
        """The job of the first hand."""
        return self.hands[0].job

    @property
    def scene(self) -> Scene:
        """The live scene of the first hand."""
        return self.hands[0].scene

    @cached_property
    def grid(self) -> Grid:
        """The grid of the configurations."""
        return Grid.from_dict(self.file.grid)

    @property
    def observed(self) -> Mapping[str, float]:
        """Observed state that the table was scored for, by joint [m or rad]."""
        return self.file.observed_states[self.table]

    @property
    def is_paper(self) -> bool:
        """Whether success is counted by the rules of the paper: goals, not rooms, and postures."""
        return self.body_collisions == "paper"

    @property
    def measure(self) -> str:
        """Name of the dexterity measure."""
        return str(self.file.metadata["measure"])

    @property
    def goals(self) -> int:
        """Number of goals of the task."""
        return int(self.weights.size)

    @property
    def environment_axes(self) -> tuple[str, ...]:
        """Names of the grid's axes that are the environment's."""
        return tuple(axis.name for axis in self.grid.environment_axes)

    def points(self, members: ArrayLike) -> FloatArray:
        """Return the values of the grid's axes of configurations [m or rad], shape (n, axes).

        Args:
            members: Flat configuration indices, shape (n,).

        Raises:
            GridError: If there is no such configuration.
        """
        at = self.grid.values(np.asarray(members, dtype=np.int64))
        return np.stack([at[axis.name] for axis in self.grid.axes], axis=-1)

    @property
    def weights(self) -> FloatArray:
        """Weights of the goals, sum 1, shape (goals,)."""
        return self.scored.sets.weights

    def reached(
        self,
        members: ArrayLike,
        offsets: Offsets,
        *,
        jobs: int = 2,
        on_progress: Progress = None,
    ) -> NDArray[np.bool_]:
        """Return which goals each configuration reaches in each sample.

        The arm is planned again in every sample, the initial configuration is not: base pose, torso
        height and bed are those of the configuration, plus the errors of the environment.

        Args:
            members: Flat configuration indices, shape (m,).
            offsets: Errors of the joints, shapes (samples,).
            jobs: Number of threads; the result does not depend on it.
            on_progress: Called with the number of pairs of configuration and sample done, and of
                all such pairs.

        Returns:
            Whether a collision-free solution exists, approachable if `with_approach`, shape
            (m, samples, goals).

        Raises:
            GridError: If there is no such configuration.
        """
        poses = self.poses(members)
        samples = samples_of(offsets)
        out = np.zeros((poses.state.size, samples, self.weights.size), dtype=np.bool_)
        step = counter(poses.state.size * samples, on_progress)
        for state in np.unique(poses.state):
            rows = np.flatnonzero(poses.state == state)
            for first in range(0, samples, CHUNK):
                columns = np.arange(first, min(first + CHUNK, samples))
                runs = [
                    Run(int(row), start, min(start + BATCH, columns.size))
                    for row in rows
                    for start in range(0, columns.size, BATCH)
                ]
                samples_here = _part(offsets, columns)
                for run, found in self._found(int(state), samples_here, poses, runs, jobs):
                    out[run.row, columns[run.start : run.stop]] = found
                    step(len(found))
        return out

    def reached_each(
        self,
        members: ArrayLike,
        offsets: Offsets,
        *,
        jobs: int = 2,
        on_progress: Progress = None,
    ) -> NDArray[np.bool_]:
        """Return which goals configuration i reaches in sample i.

        Args:
            members: Flat configuration indices, shape (samples,).
            offsets: Errors of the joints, shapes (samples,).
            jobs: Number of threads; the result does not depend on it.
            on_progress: Called with the number of samples done and of all samples.

        Returns:
            Whether a collision-free solution exists, approachable if `with_approach`, shape
            (samples, goals).

        Raises:
            GridError: If there is no such configuration.
            TcsError: If there are more or fewer configurations than samples.
        """
        poses = self.poses(members)
        if poses.state.size != samples_of(offsets):
            raise TcsError(
                f"{poses.state.size} configurations for {samples_of(offsets)} samples; must be "
                "one for each."
            )
        out = np.zeros((poses.state.size, self.weights.size), dtype=np.bool_)
        step = counter(len(out), on_progress)
        for state in np.unique(poses.state):
            rows = np.flatnonzero(poses.state == state)
            for first in range(0, rows.size, CHUNK):
                part = rows[first : first + CHUNK]
                runs = [Run(int(row), i, i + 1) for i, row in enumerate(part)]
                samples_here = _part(offsets, part)
                for run, found in self._found(int(state), samples_here, poses, runs, jobs):
                    out[run.row] = found[0]
                    step(1)
        return out

    def outcome(self, member: int, offsets: Offsets) -> HandScores:
        """Return the kernel's scores of a configuration, given by flat index, in each sample.

        Raises:
            GridError: If there is no such configuration.
        """
        poses = self.poses([member])
        scenes = self._scenes(int(poses.state[0]), offsets)
        return scenes.scores(poses, Run(0, 0, samples_of(offsets)))

    def solutions(
        self, member: int, offsets: Offsets
    ) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
        """Return which goals a configuration reaches in each sample, and the arm joints.

        Returns:
            Reached goals, shape (samples, goals), and arm joints [rad], shape (samples, goals, 7);
            joints are 0 where a goal is not reached.
        """
        found, _ = self.outcome(member, offsets)
        return found.reason == Reason.REACHED, found.joints

    def clipped(self, members: NDArray[np.integer[Any]], offsets: Offsets) -> int:
        """Return the number of samples in which an error would move a joint beyond its limits.

        The joint then stays at the limit: a flat head rest cannot be lowered.

        Args:
            members: Flat configuration indices, shape (n, m); n is 1, or one for each sample.
            offsets: Errors of the joints, shapes (samples,).
        """
        state = members // self.scored.sets.state_size
        beyond = np.zeros(samples_of(offsets), dtype=np.bool_)
        for number in np.unique(state):
            beyond |= self.positions(int(number), offsets)[1] & (state == number).any(axis=1)
        return int(np.count_nonzero(beyond))

    def clipped_at(self, points: FloatArray, offsets: Offsets) -> int:
        """Return the same for the members of one set, by values of the axes, shape (m, axes)."""
        beyond = np.zeros(samples_of(offsets), dtype=np.bool_)
        for point in points.tolist():
            at = {axis.name: v for axis, v in zip(self.grid.environment_axes, point, strict=False)}
            beyond |= displaced(self.job, self.scene, {**self.observed, **at}, offsets)[1]
        return int(np.count_nonzero(beyond))

    def poses(self, members: ArrayLike) -> Rows:
        """Return the base poses of configurations, given by flat index.

        Raises:
            GridError: If there is no such configuration.
        """
        grid = self.grid
        flat = np.asarray(members, dtype=np.int64)
        at = grid.values(flat)
        return Rows(
            state=flat // self.scored.sets.state_size,
            x=at["base_x"],
            y=at["base_y"],
            yaw=at["base_yaw"],
            torso=flat % grid.axis("torso").count,
        )

    def nominal(self, state: int) -> dict[str, float]:
        """Return the positions of the joints of a state without error, by name [m or rad].

        Args:
            state: Number of the environment's state, as in `Rows`.
        """
        axes = self.grid.environment_axes
        along = np.unravel_index(state, self.grid.environment_shape) if axes else ()
        chosen = {axis.name: float(axis.values[i]) for axis, i in zip(axes, along, strict=True)}
        return {**self.observed, **chosen}

    def positions(
        self, state: int, offsets: Offsets
    ) -> tuple[dict[str, FloatArray], NDArray[np.bool_]]:
        """Return joint positions in each sample, and whether a joint was held at its limit.

        Args:
            state: Number of the environment's state, as in `Rows`.
            offsets: Errors of the joints, shapes (samples,).
        """
        return displaced(self.job, self.scene, self.nominal(state), offsets)

    def _scenes(self, state: int, offsets: Offsets, jobs: int = 1) -> PerturbedScenes:
        """Return one state of the environment in each sample, as arrays; the last ones are kept."""
        self.start.ensure()
        positions, _ = self.positions(state, offsets)
        key = states_digest(positions, lambda some: "")
        found = self.known_scenes.pop(key, None)
        if found is None:
            scenes = tuple(hand.scenes(positions, self.measure, jobs) for hand in self.hands)
            found = PerturbedScenes(scenes, self.together)
        self.known_scenes[key] = found
        while len(self.known_scenes) > KEPT_SCENES:
            self.known_scenes.pop(next(iter(self.known_scenes)))
        return found

    def _found(
        self, state: int, offsets: Offsets, poses: Rows, runs: list[Run], jobs: int
    ) -> Iterator[tuple[Run, BoolArray]]:
        """Yield the goals that each run reaches in one state of the environment."""
        if self.blocks is None:
            yield from self._scenes(state, offsets, jobs).reached(poses, runs, jobs)
            return
        positions, _ = self.positions(state, offsets)
        states = states_digest(
            positions, lambda some: "".join(hand.arrays_digest(some) for hand in self.hands)
        )
        yield from kept_runs(
            self.blocks, states, lambda: self._scenes(state, offsets, jobs), poses, runs, jobs
        )


def _part(offsets: Offsets, columns: IntArray) -> Offsets:
    """Return the errors in some of the samples."""
    return {name: values[columns] for name, values in offsets.items()}


def _states(positions: Mapping[str, FloatArray]) -> Iterator[dict[str, float]]:
    """Yield the positions of the joints in each state, by name."""
    for i in range(samples_of(positions)):
        yield {name: float(values[i]) for name, values in positions.items()}


def counter(total: int, on_progress: Progress) -> Callable[[int], None]:
    """Return a function that adds up work done and reports the sum."""
    count = 0

    def step(more: int) -> None:
        nonlocal count
        count += more
        if on_progress is not None:
            on_progress(count, total)

    return step
