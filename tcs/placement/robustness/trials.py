"""Trials: what a configuration still reaches in a room that is not where it is believed to be."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike, NDArray

from tcs.errors import SelectionError, TcsError
from tcs.kernel.arrays import FloatArray, GridArrays, IntArray
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.sweep import Scores, gripper_contacts, score_slice
from tcs.model.scene import ErrorDistribution, LoweredScene, Scene, environment_at
from tcs.placement.robustness.error_model import ErrorModel, Offsets
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import rebuild_scene
from tcs.placement.scoring.sweep import warm_up
from tcs.placement.store import ScoreFile, StateTables
from tcs.placement.tables import Reason

AT_ONCE = 1000
"""Samples for which the room is held at once: some ten megabytes."""
BATCH = 500
"""Configurations in samples that a thread takes at once: some milliseconds of work."""

Errors = str | Path | Mapping[str, ErrorDistribution] | None
Progress = Callable[[int, int], None] | None


@dataclass(frozen=True, eq=False)
class Trials:
    """One table of a score file, with everything at hand to try its configurations again.

    Making it builds Drake's plant, which takes half a second: keep it to try several sets.
    """

    file: ScoreFile
    """The scores."""
    table: int
    """Which of its tables: how the person is found."""
    errors: ErrorModel
    """How far off the room may be."""
    checks_base: bool
    """Whether the base and the rest of the robot must be free of the room as well."""
    job: Job
    """What was scored."""
    scene: Scene
    lowered: LoweredScene
    compile_seconds: float
    """What compiling the kernel, or loading its machine code, took."""

    @classmethod
    def of(
        cls,
        file: ScoreFile,
        *,
        errors: Errors = None,
        table: int | None = None,
        check_base: bool = False,
        on_compile: Callable[[], None] | None = None,
    ) -> Trials:
        """Return the trials of a score file.

        Args:
            file: A score file.
            errors: Path of an error file, or errors by joint, in place of the environment's own.
            table: Number of one of its tables; by default the nominal one.
            check_base: Whether the base must be free as well, which the paper leaves out.
            on_compile: Called first, when the kernel has to be compiled.

        Raises:
            StoreMismatchError: If the models are not those the file was made from.
            DataFileError: If a file cannot be used.
            UnknownNameError: If something is named that is not there.
            SelectionError: If there is no such table.
        """
        job, scene, lowered = rebuild_scene(file)
        chosen = file.nominal_index if table is None else table
        if not 0 <= chosen < len(file.tables):
            raise SelectionError(
                f"There is no table {table}; the file has {len(file.tables)}, counted from 0."
            )
        model = ErrorModel.of(scene, errors)
        measure = str(file.metadata["measure"])
        problem = build_problem(lowered.arrays, lowered.grid, measure)
        seconds = warm_up(problem, on_compile)
        return cls(file, chosen, model, check_base, job, scene, lowered, seconds)

    def at_table(self, table: int) -> Trials:
        """Return the trials of another table of the same file."""
        return dataclasses.replace(self, table=table)

    @property
    def scored(self) -> StateTables:
        """Scores and sets of the table."""
        return self.file.tables[self.table]

    @property
    def observed(self) -> Mapping[str, float]:
        """How the person is found in this table, by joint [m or rad]."""
        return self.file.observed_states[self.table]

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

        The arm is planned anew in every sample, the configuration is not: its base stays where
        it stands in W, its torso and the bed as they are set, but for the errors.

        Args:
            members: Flat configuration indices, shape (m,).
            offsets: By how much joints are off, shapes (samples,).
            jobs: Number of threads; the result does not depend on it.
            on_progress: Called with configurations in samples done and in all.

        Returns:
            Whether a collision-free solution was found, shape (m, samples, goals).

        Raises:
            GridError: If there is no such configuration.
        """
        stands = self._stands(members)
        samples = samples_of(offsets)
        out = np.zeros((stands.state.size, samples, self.weights.size), dtype=np.bool_)
        step = _counter(stands.state.size * samples, on_progress)
        for state in np.unique(stands.state):
            rows = np.flatnonzero(stands.state == state)
            for first in range(0, samples, AT_ONCE):
                columns = np.arange(first, min(first + AT_ONCE, samples))
                world = self._world(int(state), offsets, columns)
                runs = [
                    _Run(int(row), start, min(start + BATCH, columns.size))
                    for row in rows
                    for start in range(0, columns.size, BATCH)
                ]
                for run, found in _tried(world, stands, runs, jobs):
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
            offsets: By how much joints are off, shapes (samples,).
            jobs: Number of threads; the result does not depend on it.
            on_progress: Called with samples done and in all.

        Returns:
            Whether a collision-free solution was found, shape (samples, goals).

        Raises:
            GridError: If there is no such configuration.
            TcsError: If there are more or fewer configurations than samples.
        """
        stands = self._stands(members)
        if stands.state.size != samples_of(offsets):
            raise TcsError(
                f"{stands.state.size} configurations for {samples_of(offsets)} samples; must be "
                "one for each."
            )
        out = np.zeros((stands.state.size, self.weights.size), dtype=np.bool_)
        step = _counter(len(out), on_progress)
        for state in np.unique(stands.state):
            rows = np.flatnonzero(stands.state == state)
            for first in range(0, rows.size, AT_ONCE):
                part = rows[first : first + AT_ONCE]
                world = self._world(int(state), offsets, part)
                runs = [_Run(int(row), i, i + 1) for i, row in enumerate(part)]
                for run, found in _tried(world, stands, runs, jobs):
                    out[run.row] = found[0]
                    step(1)
        return out

    def outcome(self, member: int, offsets: Offsets) -> Scores:
        """Return all the kernel finds for a flat configuration index, a row for each sample.

        Raises:
            GridError: If there is no such configuration.
        """
        stands = self._stands([member])
        columns = np.arange(samples_of(offsets))
        world = self._world(int(stands.state[0]), offsets, columns)
        return _scored(world, stands, _Run(0, 0, columns.size))

    def solutions(
        self, member: int, offsets: Offsets
    ) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
        """Return which goals a configuration reaches in each sample, and the arm's joints there.

        Shapes are (samples, goals) and (samples, goals, 7) [rad], 0 where there is none.
        """
        found = self.outcome(member, offsets)
        return found.reason == Reason.REACHED, found.joints

    def clipped(self, members: NDArray[np.integer[Any]], offsets: Offsets) -> int:
        """Return in how many samples an error would take a joint beyond its limits.

        The joint stops there: a head rest that lies flat cannot be lower.

        Args:
            members: Flat configuration indices, shape (n, m); n is 1, or one for each sample.
            offsets: By how much joints are off, shapes (samples,).
        """
        state = members // self.scored.sets.state_size
        beyond = np.zeros(samples_of(offsets), dtype=np.bool_)
        for number in np.unique(state):
            beyond |= self._positions(int(number), offsets)[1] & (state == number).any(axis=1)
        return int(np.count_nonzero(beyond))

    def _stands(self, members: ArrayLike) -> _Stands:
        grid = self.job.grid
        flat = np.asarray(members, dtype=np.int64)
        at = grid.values(flat)
        return _Stands(
            state=flat // self.scored.sets.state_size,
            x=at["base_x"],
            y=at["base_y"],
            yaw=at["base_yaw"],
            torso=flat % grid.axis("torso").count,
        )

    def _positions(
        self, state: int, offsets: Offsets
    ) -> tuple[dict[str, FloatArray], NDArray[np.bool_]]:
        """Return where joints stand in each sample, and whether one of them was stopped."""
        axes = self.job.grid.environment_axes
        along = np.unravel_index(state, self.job.grid.environment_shape) if axes else ()
        believed = {
            **self.observed,
            **{axis.name: float(axis.values[i]) for axis, i in zip(axes, along, strict=True)},
        }
        samples = samples_of(offsets)
        positions = {name: np.full(samples, value) for name, value in believed.items()}
        stopped = np.zeros(samples, dtype=np.bool_)
        for name, off in offsets.items():
            nominal = believed.get(name, self.job.spec.environment.joints.get(name, 0.0))
            lower, upper = self.scene.built.environment_joints.limits(name)
            # A grid's last step may be a rounding beyond the limit; there it is to stay.
            meant = nominal + np.asarray(off, dtype=np.float64)
            positions[name] = np.clip(meant, min(lower, nominal), max(upper, nominal))
            stopped |= positions[name] != meant
        return positions, stopped

    def _world(
        self,
        state: int,
        offsets: Offsets,
        columns: IntArray,
    ) -> _World:
        """Return the room as arrays: one state of the environment, in some of the samples."""
        positions, _ = self._positions(state, {name: v[columns] for name, v in offsets.items()})
        states = (
            {name: float(values[i]) for name, values in positions.items()}
            for i in range(columns.size)
        )
        arrays = environment_at(self.lowered, self.scene, self.job.task, states)
        if not self.checks_base:
            arrays = arrays._replace(body_vs_room=np.zeros_like(arrays.body_vs_room))
        torso_levels = len(arrays.arm_base_p)
        origin = np.zeros(1)
        grid = GridArrays(columns.size, origin, origin, origin, torso_levels)
        problem = build_problem(arrays, grid, str(self.file.metadata["measure"]))
        return _World(problem, gripper_contacts(problem))


class _World(NamedTuple):
    """A room in some samples, as the kernel reads it."""

    problem: Problem
    """Each sample is a state of the environment; the base has a single place yet to be set."""
    grippers: IntArray
    """Contacts of the gripper at each goal."""

    def from_place(self, stands: _Stands, row: int) -> Problem:
        """Return the problem with the base at the place, and the torso at the level, of a row."""
        problem, level = self.problem, int(stands.torso[row])
        only = slice(level, level + 1)
        return problem._replace(
            base_x=stands.x[row : row + 1],
            base_y=stands.y[row : row + 1],
            base_yaw=stands.yaw[row : row + 1],
            base_R=problem.base_R[only],
            base_p=problem.base_p[only],
            body=problem.body[only],
            body_A=problem.body_A[only],
            body_balls=problem.body_balls[only],
            torso_levels=1,
        )


class _Stands(NamedTuple):
    """Where configurations are, shapes (m,)."""

    state: IntArray
    """Number of the environment's state."""
    x: FloatArray
    y: FloatArray
    yaw: FloatArray
    torso: IntArray
    """Number of the torso's level."""


class _Run(NamedTuple):
    """One configuration in some samples of a world, in a row."""

    row: int
    start: int
    stop: int


def samples_of(offsets: Offsets) -> int:
    """Return how many samples there are.

    Raises:
        TcsError: If joints have different numbers of them, or no joint is off.
    """
    sizes = {len(values) for values in offsets.values()}
    if len(sizes) != 1:
        raise TcsError(
            "Errors must be as many for each joint, and there must be some for one joint at least."
        )
    return sizes.pop()


def _counter(total: int, on_progress: Progress) -> Callable[[int], None]:
    """Return a function that is told what was done and passes the sum on."""
    count = 0

    def step(more: int) -> None:
        nonlocal count
        count += more
        if on_progress is not None:
            on_progress(count, total)

    return step


def _tried(
    world: _World, stands: _Stands, runs: list[_Run], jobs: int
) -> Iterator[tuple[_Run, NDArray[np.bool_]]]:
    """Yield what each run reaches, shape (stop - start, goals); runs share threads by batches."""
    batches: list[list[_Run]] = [[]]
    size = 0
    for run in runs:
        if size >= BATCH:
            batches.append([])
            size = 0
        batches[-1].append(run)
        size += run.stop - run.start
    if jobs < 1:
        raise TcsError(f"jobs is {jobs}; must be 1 or more threads.")
    parallel = Parallel(n_jobs=jobs, prefer="threads", return_as="generator")
    for batch, found in zip(
        batches, parallel(delayed(_try)(world, stands, batch) for batch in batches), strict=True
    ):
        yield from zip(batch, found, strict=True)


def _try(world: _World, stands: _Stands, runs: list[_Run]) -> list[NDArray[np.bool_]]:
    return [_scored(world, stands, run).reason == Reason.REACHED for run in runs]


def _scored(world: _World, stands: _Stands, run: _Run) -> Scores:
    """Return the kernel's scores of one run, by the very code that scores a grid."""
    problem = world.from_place(stands, run.row)
    shape = (run.stop - run.start, problem.goal_p.shape[1])
    scores = Scores(
        reason=np.empty(shape, np.uint8),
        contact=np.empty(shape, np.int32),
        isotropy=np.zeros(shape, np.float32),
        joints=np.zeros((*shape, 7), np.float32),
    )
    score_slice(problem, world.grippers, run.start, run.stop, scores)
    return scores
