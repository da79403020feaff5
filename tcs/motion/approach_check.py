"""Re-check of the approaches of a score file: straight, within limits, free of contact by Drake."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from tcs.errors import TcsError
from tcs.kernel.approach.regions import approach_spline
from tcs.kernel.approach.scene import LineScene, approach_scene
from tcs.kernel.approach.sweep import ApproachLines
from tcs.kernel.arrays import FloatArray
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import rows_at
from tcs.model.scene import LoweredScene, NeighbourList, Scene, goal_poses
from tcs.motion.curves import Curve
from tcs.motion.recheck import false_pieces
from tcs.motion.stops import single_axes, single_grid
from tcs.placement.scoring.approaches import approach_lines
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.store import APPROACH, ScoreFile

LINE_BAR = 1e-3
"""Greatest error of the tool along the line [rad and m]: twice what the kernel allows in the middle
of a piece."""
SPEED_BAR = 1.1
"""Greatest fraction of a velocity limit: the kernel keeps the limits at the points of a spline, and
in the mean between them, where cubics are a little faster."""
SAME_POSTURE = 1e-5
"""Greatest distance of the end of an approach from the stored posture [rad]: joints are stored as
float32, and the closed form moves others by more where the arm is nearly singular."""
SAMPLES = 9
"""Postures on each piece whose tool is compared with the line."""


@dataclass(frozen=True)
class ApproachCheck:
    """Result of re-checking approaches; None for values that no check gave."""

    checked: int
    """Number of reached pairs whose approach was re-checked, at postures between which no point of
    the arm moves by more than a millimetre."""
    refined_checked: int
    """Number of these that are of refined sets."""
    false: int
    """Number of these whose approach is not found again from the stored posture, leaves the line,
    exceeds limits or is in contact."""
    max_line_error: float | None
    """Greatest error of the tool along the line [rad and m]."""
    max_speed: float | None
    """Greatest velocity of a joint at the tool's speed, as a fraction of its limit."""

    @property
    def is_sound(self) -> bool:
        """Whether no approach is false."""
        return self.false == 0

    def to_json(self) -> dict[str, Any]:
        """Return the findings as plain containers."""
        return asdict(self)


class ApproachFinding(NamedTuple):
    """Drake's finding on one approach."""

    is_true: bool
    """Whether the approach is straight, within limits and free of contact."""
    line_error: float
    """Greatest error of the tool along the line [rad and m]."""
    speed: float
    """Greatest velocity of a joint at the tool's speed, as a fraction of its limit."""


@dataclass(frozen=True, eq=False)
class ApproachScene:
    """A job whose approaches are re-checked."""

    job: Job
    scene: Scene
    lowered: LoweredScene
    problem: Problem
    lines: ApproachLines
    neighbours: NeighbourList
    around: LineScene
    """The scene of the certified checks."""

    @classmethod
    def of(cls, job: Job, scene: Scene, lowered: LoweredScene) -> Self:
        """Prepare a job.

        Args:
            job: The job.
            scene: Its scene.
            lowered: The same as arrays.

        Raises:
            RobotError: If a velocity limit is unknown.
        """
        problem = build_problem(lowered.arrays)
        neighbours, around = NeighbourList(scene), approach_scene(problem)
        return cls(job, scene, lowered, problem, approach_lines(job), neighbours, around)

    def at(self, values: FloatArray, observed: Mapping[str, float]) -> Self:
        """Return the same with one configuration, on or off the grid.

        Args:
            values: Value of each axis of the grid [m or rad].
            observed: State of the observed axes [m or rad].
        """
        job = replace(
            self.job,
            grid=single_grid(self.job.grid.axes, values.tolist()),
            observed=single_axes(
                self.job.observed, [observed[axis.name] for axis in self.job.observed]
            ),
        )
        return self.of(job, self.scene, job.lowered(self.scene))

    def check(self, number: int, goal: int, q: FloatArray) -> ApproachFinding | None:
        """Return the finding on the approach of a posture, None if no approach is found from it.

        Args:
            number: Flat index of the initial configuration in the scored grid.
            goal: Number of the goal.
            q: Joint angles at the goal [rad], shape (7,).
        """
        row = rows_at(self.lowered.grid, [number])
        spline = approach_spline(self.problem, self.lines, row, goal, q, self.around)
        if spline is None:
            return None
        points, tangents = spline
        turns = np.abs(np.angle(np.exp(1j * (points[-1] - q))))
        curve = Curve(np.linspace(0.0, 1.0, len(points)), points, tangents)
        self._place(number)
        error = self._line_error(curve, goal)
        speed = _greatest_rate(curve, self.lines.fastest[goal])
        is_true = (
            bool(np.all(turns <= SAME_POSTURE))
            and error <= LINE_BAR
            and speed <= SPEED_BAR
            and false_pieces(self.neighbours, self.around.motion, curve) == 0
        )
        return ApproachFinding(is_true, error, speed)

    def _place(self, number: int) -> None:
        """Set the live scene to a configuration of the scored grid."""
        scene, grid = self.scene, self.job.scored_grid
        at = {name: float(value) for name, value in grid.values(number).items()}
        scene.place_base(at["base_x"], at["base_y"], at["base_yaw"])
        scene.set_torso(at["torso"])
        for axis in grid.environment_axes:
            scene.set_joint(axis.name, at[axis.name])

    def _line_error(self, curve: Curve, goal: int) -> float:
        """Return the greatest error of the tool along the line to a goal [rad and m].

        To a goal that is a region the line ends where the tool is at the end of the curve.
        """
        scene, worst, task = self.scene, 0.0, self.job.task
        axis, end = self.problem.goals.turn, goal_poses(scene, task)[goal]
        if task.goals[goal].region:
            scene.set_arm(curve.q[-1])
            end = scene.tool_pose()
        X_GW, offset = end.inverse(), np.asarray(task.goals[goal].approach.offset)
        for begin, fraction, q in _samples(curve):
            scene.set_arm(q)
            X_GT = X_GW @ scene.tool_pose()
            ahead = 1.0 - (begin + fraction) / curve.pieces
            off = float(np.linalg.norm(X_GT.translation() + ahead * offset))
            turned = float(X_GT.rotation().ToAngleAxis().angle())
            if np.any(axis):
                # An arm of five joints may rotate the tool about this axis on the way.
                turned = float(np.linalg.norm(X_GT.rotation().matrix() @ axis - axis))
            worst = max(worst, off, turned)
        return worst


class _Stored(NamedTuple):
    """A stored posture at a goal."""

    table: int
    hand: int
    """Number of the hand."""
    goal: int
    place: int | FloatArray
    """Flat index of the configuration, or the values of its axes."""
    q: FloatArray
    """Joint angles [rad], shape (7,)."""


def check_approaches(
    file: ScoreFile,
    *,
    pairs: int = 25,
    seed: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> ApproachCheck:
    """Re-check approaches of random reached pairs of a file that was scored with approach.

    From the stored posture the arm is led back along the straight approach; Drake confirms the
    line, the limits and that nothing touches.

    Args:
        file: A score file.
        pairs: Number of reached pairs, and as many of refined sets if there are any.
        seed: Seed of the random sample.
        on_progress: Called with the number of checked pairs and their total.

    Raises:
        TcsError: If the file was scored without approach, or `pairs` is negative.
        StoreMismatchError: If the models differ from those the file was made from.
    """
    if pairs < 0:
        raise TcsError(f"check_approaches: pairs is {pairs}; it may not be negative.")
    if APPROACH not in file.metadata:
        raise TcsError("The file was scored without approach: it has no approaches to check.")
    random = np.random.default_rng(seed)
    drawn = [*_drawn(file, pairs, random), *_drawn_refined(file, pairs, random)]
    scenes = [ApproachScene.of(*built) for built in rebuild_scenes(file)] if drawn else []
    findings: list[ApproachFinding | None] = []
    for stored in drawn:
        findings.append(_finding(file, scenes, stored))
        if on_progress is not None:
            on_progress(len(findings), len(drawn))
    found = [finding for finding in findings if finding is not None]
    return ApproachCheck(
        checked=len(findings),
        refined_checked=sum(not isinstance(stored.place, int) for stored in drawn),
        false=sum(finding is None or not finding.is_true for finding in findings),
        max_line_error=max((finding.line_error for finding in found), default=None),
        max_speed=max((finding.speed for finding in found), default=None),
    )


def _drawn(file: ScoreFile, pairs: int, random: np.random.Generator) -> Iterator[_Stored]:
    """Yield random reached pairs of the grid, in their order."""
    reached = [
        (table, int(h), int(g))
        for table, tables in enumerate(file.tables)
        for h, g in np.argwhere(tables.scores.reached)
    ]
    for n in sorted(random.permutation(len(reached))[:pairs].tolist()):
        table, h, g = reached[n]
        scores = file.tables[table].scores
        q = np.asarray(scores.joints_of(h, g), dtype=np.float64)
        hand = 0 if scores.hand is None else int(scores.hand[h, g])
        yield _Stored(table, hand, g, h, q)


def _drawn_refined(file: ScoreFile, pairs: int, random: np.random.Generator) -> Iterator[_Stored]:
    """Yield random goals that members of refined sets reach, in their order."""
    reached = [
        (table, *map(int, at))
        for table, tables in enumerate(file.tables)
        if tables.refined is not None
        for at in np.argwhere(tables.refined.reached)
    ]
    for n in sorted(random.permutation(len(reached))[:pairs].tolist()):
        table, row, member, g = reached[n]
        refined = file.tables[table].refined
        assert refined is not None
        q = np.asarray(refined.arm_joints[row, member, g], dtype=np.float64)
        hand = 0 if refined.hand is None else int(refined.hand[row, member, g])
        yield _Stored(table, hand, g, refined.values[row, member], q)


def _finding(
    file: ScoreFile, scenes: Sequence[ApproachScene], stored: _Stored
) -> ApproachFinding | None:
    """Return the finding on the approach of a stored posture, given the scene of each hand.

    None if no approach is found from it.
    """
    scene = scenes[stored.hand]
    goal = file.goals_of_hands[stored.hand].index(stored.goal)
    if isinstance(stored.place, int):
        number = stored.table * file.configurations.size + stored.place
        return scene.check(number, goal, stored.q)
    return scene.at(stored.place, file.observed_states[stored.table]).check(0, goal, stored.q)


def _samples(curve: Curve) -> Iterator[tuple[int, float, FloatArray]]:
    """Yield the number of a piece, a fraction of it and the posture there, over the curve."""
    fractions = np.linspace(0.0, 1.0, SAMPLES)
    for piece in range(curve.pieces):
        for fraction, q in zip(fractions, curve.points(piece, fractions), strict=True):
            yield piece, float(fraction), q


def _greatest_rate(curve: Curve, fastest: FloatArray) -> float:
    """Return the greatest rate of a joint by the parameter, as a fraction of the fastest allowed.

    Args:
        curve: A curve whose parameter goes from 0 to 1.
        fastest: Greatest rate of each joint [rad], shape (7,).
    """
    fractions = np.linspace(0.0, 1.0, SAMPLES)
    rates = [
        np.diff(curve.points(piece, fractions), axis=0) * (curve.pieces * (SAMPLES - 1))
        for piece in range(curve.pieces)
    ]
    return float(np.max(np.abs(np.concatenate(rates)) / fastest))
