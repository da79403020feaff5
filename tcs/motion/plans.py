"""Planning: for each stop of a set, a tour of timed motions through the goals it serves."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, TcsError, UnknownNameError
from tcs.kernel.cache import announced
from tcs.model.grid import Grid, InitialConfiguration
from tcs.model.robots import LEAST_JERK, MOST_JERK
from tcs.motion.motion_plan import GoalResult, MotionPlan
from tcs.motion.recheck import StopCheck
from tcs.motion.stop_tour import ORDERS, plan_stop
from tcs.motion.stops import Stop
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import made_from, rebuild_scene
from tcs.placement.selection import Choice
from tcs.placement.store import ScoreFile, file_of_arm
from tcs.placement.tables import RefinedSet

PLANNED = 0.5
"""Fraction of the progress of a stop that is planning; the rest is the re-check with Drake."""


def plan(
    file: ScoreFile,
    members: Choice | RefinedSet | Sequence[int] | InitialConfiguration,
    *,
    order: str = "best",
    jerk: float | None = None,
    seed: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> MotionPlan:
    """Plan the motions that do a task from some initial configurations.

    At each stop the arm goes from its rest posture to the first goal, straight in along its
    approach, straight out along its retreat, on to the next goal, and back to rest. The other arm
    and the torso do not move. Every curve is certified free of contact and re-checked with Drake.

    Args:
        file: A score file.
        members: A selected set, on or off the grid; a refined set; or flat configuration indices
            of the stops in the order of the visits, in a file with observed states those of all its
            tables one after the other. Or one initial configuration, on or off the grid, from which
            every goal is tried.
        order: Order of the goals at a stop: "best" for the shortest tour, "given" for their own.
        jerk: Greatest jerk of every joint [rad/s^3], beside those of the robot file; None for
            these alone.
        seed: Seed of the planner; the plan is the same for the same seed.
        on_progress: Called with the finished per cent and 100, after every goal and every motion
            that is re-checked; what it raises ends the planning.
        on_compile: Called before the planner compiles, if it has to.

    Returns:
        The plan; goals without a motion carry the reason.

    Raises:
        StoreMismatchError: If the models differ from those the file was made from.
        RobotError: If a velocity limit of the arm is unknown.
        UnknownNameError: If there is no such order.
        TcsError: If there is no such configuration, it lacks an axis, or the jerk is out of its
            range.
        SelectionError: If the file is of several arms, and the configurations use more than one,
            or one is not given by its number.
    """
    begun = time.perf_counter()
    if order not in ORDERS:
        raise UnknownNameError("order", order, ORDERS)
    if jerk is not None and not LEAST_JERK <= jerk <= MOST_JERK:
        raise TcsError(
            f"plan: the jerk is {jerk:g} rad/s^3, but must be in [{LEAST_JERK:g}, {MOST_JERK:g}]."
        )
    numbers: Sequence[int] | None = None
    if isinstance(members, Choice) and members.refined is not None:
        table = 0 if members.match is None else members.match.index
        members = RefinedSet(table, members.refined, members.order)
    whole = file
    if isinstance(members, RefinedSet):
        file = _file_of_refined(file, members)
    elif file.arms:
        numbers = _numbers(file, members)
        file, members = _of_one_arm(file, numbers)
    job, scene, _ = rebuild_scene(file)
    limits = np.minimum(job.spec.robot.arm_jerks(), np.inf if jerk is None else jerk)
    if isinstance(members, RefinedSet):
        places, serving = _refined_places(whole, job, members)
    else:
        places, serving = _places(file, job, members)
    results: dict[int, GoalResult] = {
        goal: GoalResult(goal, None, False, "unreached")
        for goal in range(len(job.task.goals))
        if not serving[goal]
    }
    stops, edges, false, check = [], 0, 0, None
    for number, (h, values) in enumerate(places):
        goals = [
            goal
            for goal, able in enumerate(serving)
            if number in able
            and not (goal in results and results[goal].done)
            # The most dexterous stop serves a goal; later stops take over what it could not do.
            and (able[0] == number or goal in results)
        ]
        index = h if numbers is None else numbers[number]
        report = _StopProgress(on_progress, number, len(places))
        with announced(on_compile):
            stop = Stop.at_values(job, scene, values, seed)
            planned, found = plan_stop(stop, index, number, goals, order, limits, report.planned)
        results |= {result.goal: result for result in found}
        stops.append(planned)
        check = StopCheck(stop, check)
        edges += sum(segment.edges for segment in planned.segments)
        for done, segment in enumerate(planned.segments, 1):
            false += check.false_pieces(segment)
            report.checked(done / len(planned.segments))
        report.checked(1.0)
    return MotionPlan(
        made_from=made_from(file),
        joints=tuple(job.spec.robot.arm_joints),
        stops=tuple(stops),
        results=tuple(results[goal] for goal in range(len(job.task.goals))),
        edges=edges,
        false=false,
        seed=seed,
        seconds=time.perf_counter() - begun,
        jerk_limits=tuple(limits.tolist()) if np.any(np.isfinite(limits)) else None,
    )


@dataclass(frozen=True)
class _StopProgress:
    """Reports the finished fraction of one stop after those before it."""

    on_progress: Callable[[int, int], None] | None
    stop: int
    stops: int

    def planned(self, fraction: float) -> None:
        self._report(PLANNED * fraction)

    def checked(self, fraction: float) -> None:
        self._report(PLANNED + (1.0 - PLANNED) * fraction)

    def _report(self, fraction: float) -> None:
        if self.on_progress is not None:
            self.on_progress(round(100 * (self.stop + fraction) / self.stops), 100)


def _numbers(
    file: ScoreFile, members: Choice | Sequence[int] | InitialConfiguration
) -> Sequence[int]:
    """Return the flat indices of the stops in a file of several arms, in the order of the visits.

    Raises:
        SelectionError: If a single configuration is given by its values.
    """
    if isinstance(members, InitialConfiguration):
        raise SelectionError(
            f"plan: the file is of {' and '.join(file.arms)}, so a configuration must be given by "
            "its number in `tcs export`, which names the arm: --configuration N."
        )
    if isinstance(members, Choice):
        table = 0 if members.match is None else members.match.index
        size = Grid.from_dict(file.grid).size
        return [table * size + members.indices[i] for i in members.order]
    return members


def _of_one_arm(file: ScoreFile, numbers: Sequence[int]) -> tuple[ScoreFile, list[int]]:
    """Return the file of the arm that configurations use, and their flat indices in that.

    Args:
        file: A file of several arms.
        numbers: Flat indices in it.

    Raises:
        SelectionError: If they use more than one arm.
        TcsError: If there is no such configuration.
    """
    grid = Grid.from_dict(file.grid)
    total = len(file.tables) * grid.size
    for h in numbers:
        if not 0 <= h < total:
            raise TcsError(f"plan: no configuration {h}; the file has {total:,}, from 0.")
    tables, rows = np.divmod(np.array(numbers, dtype=np.int64), grid.size)
    arms, of_arm = np.divmod(rows, grid.arm_size)
    if len(set(arms.tolist())) > 1:
        used = ", ".join(
            f"{h} ({grid.arms[arm]})" for h, arm in zip(numbers, arms.tolist(), strict=True)
        )
        raise SelectionError(
            f"plan: the stops use more than one arm, configurations {used}, and a plan is of one. "
            "Plan those of each arm: --configuration N."
        )
    arm = file_of_arm(file, grid.arms[int(arms[0])])
    return arm, (tables * grid.arm_size + of_arm).tolist()


Place = tuple[int | None, list[float]]
"""Flat index of a configuration, None off the grid, and the value of each axis [m or rad]."""


def _places(
    file: ScoreFile, job: Job, members: Choice | Sequence[int] | InitialConfiguration
) -> tuple[list[Place], list[list[int]]]:
    """Return the stops, and for each goal the numbers of those to try it from, the best first."""
    axes = job.scored_grid.axes
    if isinstance(members, InitialConfiguration):
        values = [value_of(members, axis.name) for axis in axes]
        return [(None, values)], [[0]] * len(job.task.goals)
    if isinstance(members, Choice):
        table = 0 if members.match is None else members.match.index
        members = [table * job.grid.size + members.indices[i] for i in members.order]
    for h in members:
        if not 0 <= h < job.scored_grid.size:
            raise TcsError(
                f"plan: no configuration {h}; the file has {job.scored_grid.size:,}, from 0."
            )
    of_axes = job.scored_grid.values(np.array(members, dtype=np.int64))
    places: list[Place] = [
        (h, [float(of_axes[axis.name][row]) for axis in axes]) for row, h in enumerate(members)
    ]
    return places, _serving(file, job, members)


def _file_of_refined(file: ScoreFile, chosen: RefinedSet) -> ScoreFile:
    """Return the file of the arm that a refined set uses: the file itself if it is of one arm.

    Raises:
        TcsError: If the file has no such set.
        SelectionError: If its members use more than one arm.
    """
    refined = file.tables[chosen.table].refined
    if refined is None or not 0 <= chosen.row < len(refined.origin):
        raise TcsError(f"plan: no refined set {chosen.row}. Refine the file: tcs refine FILE.")
    if not file.arms:
        return file
    grid = file.configurations
    used = {int(refined.origin[chosen.row, i]) // grid.arm_size for i in chosen.order}
    if len(used) > 1:
        raise SelectionError(
            "plan: the refined set uses more than one arm, and a plan is of one. Plan "
            "configurations of each arm: --configuration N."
        )
    return file_of_arm(file, grid.arms[used.pop()])


def _refined_places(
    file: ScoreFile, job: Job, chosen: RefinedSet
) -> tuple[list[Place], list[list[int]]]:
    """Return the stops of a refined set of a file, as `_places` does."""
    refined = file.tables[chosen.table].refined
    assert refined is not None
    observed = file.observed_states[chosen.table]
    names = [axis.name for axis in file.configurations.axes]
    places: list[Place] = []
    for i in chosen.order:
        known = {
            **observed,
            **dict(zip(names, refined.values[chosen.row, i].tolist(), strict=True)),
        }
        places.append((None, [float(known[axis.name]) for axis in job.scored_grid.axes]))
    rows = list(chosen.order)
    reached, dexterity = refined.reached[chosen.row, rows], refined.dexterity[chosen.row, rows]
    return places, _by_dexterity(reached, dexterity)


def exact_state(
    file: ScoreFile, at: InitialConfiguration, observed: Mapping[str, float]
) -> InitialConfiguration:
    """Return a state with the observed axes of a file added: as observed, or of its nominal table.

    Args:
        file: The score file.
        at: Robot and environment.
        observed: Values of observed axes [m or rad].
    """
    known = {**file.observed_states[file.nominal_index], **observed}
    units = {axis.name: "rad" if axis.unit == "deg" else "m" for axis in file.observed_axes}
    return replace(
        at,
        environment=(*known.items(), *at.environment),
        environment_units=(*(units[name] for name in known), *at.environment_units),
    )


def value_of(at: InitialConfiguration, axis: str) -> float:
    """Return the value of an axis of the grid [m or rad].

    Raises:
        TcsError: If the configuration lacks it.
    """
    values = {name: getattr(at, name) for name in ("base_x", "base_y", "base_yaw", "torso")}
    values |= dict(at.environment)
    if axis not in values:
        raise TcsError(f"plan: the state lacks the axis '{axis}'. Give it: --at {axis}=VALUE.")
    return float(values[axis])


def _serving(file: ScoreFile, job: Job, members: Sequence[int]) -> list[list[int]]:
    """Return the numbers of the members that reach each goal, the most dexterous first."""
    reached, dexterity = [], []
    for h in members:
        table, row = divmod(h, job.grid.size)
        scores = file.tables[table].scores
        reached.append(scores.reached[row])
        dexterity.append(scores.dexterity[row])
    return _by_dexterity(np.array(reached), np.array(dexterity))


def _by_dexterity(reached: NDArray[np.bool_], dexterity: NDArray[np.float32]) -> list[list[int]]:
    """Return the members that reach each goal, the most dexterous first, given shapes (m, G)."""
    order = np.argsort(-dexterity, axis=0, kind="stable")
    return [
        [int(n) for n in order[:, goal] if reached[n, goal]] for goal in range(reached.shape[1])
    ]
