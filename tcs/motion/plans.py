"""Planning: for each stop of a set, a tour of timed motions through the goals it serves."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError, UnknownNameError
from tcs.kernel.cache import announced
from tcs.model.grid import InitialConfiguration
from tcs.model.robots import LEAST_JERK, MOST_JERK
from tcs.motion.motion_plan import GoalResult, MotionPlan, StopPlan
from tcs.motion.recheck import StopCheck
from tcs.motion.stop_tour import ORDERS, plan_stop
from tcs.motion.stops import Stop
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import made_from, rebuild_scenes
from tcs.placement.selection import Choice
from tcs.placement.store import ScoreFile
from tcs.placement.tables import RefinedSet, members_by_dexterity

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
    and the torso do not move; where several hands serve the goals of a stop, each of them makes a
    tour in turn while the other arm is parked. Every curve is certified free of contact and
    re-checked with Drake.

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
    """
    begun = time.perf_counter()
    if order not in ORDERS:
        raise UnknownNameError("order", order, ORDERS)
    if jerk is not None and not LEAST_JERK <= jerk <= MOST_JERK:
        raise TcsError(
            f"plan: the jerk is {jerk:g} rad/s^3, but must be in [{LEAST_JERK:g}, {MOST_JERK:g}]."
        )
    if isinstance(members, Choice) and members.refined is not None:
        table = 0 if members.match is None else members.match.index
        members = RefinedSet(table, members.refined, members.order)
    built = rebuild_scenes(file)
    job = built[0][0]
    limits = np.minimum(
        [of_hand.spec.robot.arm_jerks() for of_hand, *_ in built], np.inf if jerk is None else jerk
    )
    if isinstance(members, RefinedSet):
        places, serving = _refined_places(file, job, members)
    else:
        places, serving = _places(file, job, members)
    results: dict[int, GoalResult] = {
        goal: GoalResult(goal, None, False, "unreached")
        for goal in range(len(serving))
        if not serving[goal]
    }
    visits = [(number, hand) for number in range(len(places)) for hand in range(len(built))]
    stops: list[StopPlan] = []
    edges, false = 0, 0
    checks: dict[int, StopCheck] = {}
    for done, (number, hand) in enumerate(visits):
        (of_hand, scene, _), of_goals = built[hand], file.goals_of_hands[hand]
        goals = [
            goal
            for goal, able in enumerate(serving)
            if (number, hand) in able
            and not (goal in results and results[goal].done)
            # The most dexterous stop serves a goal; later stops take over what it could not do.
            and (able[0] == (number, hand) or goal in results)
        ]
        if not goals and len(built) > 1:
            continue
        index, values = places[number]
        report = _StopProgress(on_progress, done, len(visits))
        with announced(on_compile):
            stop = Stop.at_values(of_hand, scene, values, seed)
            of_stop = [of_goals.index(goal) for goal in goals]
            planned, found = plan_stop(
                stop, index, len(stops), of_stop, order, limits[hand], report.planned
            )
        planned, found = _of_task(planned, found, of_goals)
        results |= {result.goal: result for result in found}
        if file.hands:
            planned = replace(
                planned, hand=file.hand_names[hand], joints=tuple(of_hand.spec.robot.arm_joints)
            )
        stops.append(planned)
        checks[hand] = StopCheck(stop, checks.get(hand))
        edges += sum(segment.edges for segment in planned.segments)
        for part, segment in enumerate(planned.segments, 1):
            false += checks[hand].false_pieces(segment)
            report.checked(part / len(planned.segments))
        report.checked(1.0)
    return MotionPlan(
        made_from=made_from(file),
        joints=tuple(job.spec.robot.arm_joints),
        stops=tuple(stops),
        results=tuple(results[goal] for goal in range(len(serving))),
        edges=edges,
        false=false,
        seed=seed,
        seconds=time.perf_counter() - begun,
        jerk_limits=tuple(limits[0].tolist()) if np.any(np.isfinite(limits)) else None,
    )


def _of_task(
    planned: StopPlan, found: Sequence[GoalResult], goals: Sequence[int]
) -> tuple[StopPlan, list[GoalResult]]:
    """Return the plan of a stop with the numbers of the goals in the task, not of the hand."""

    def number(goal: int | None) -> int | None:
        return None if goal is None else goals[goal]

    segments = tuple(
        replace(segment, start=number(segment.start), end=number(segment.end))
        for segment in planned.segments
    )
    return replace(planned, segments=segments), [
        replace(result, goal=goals[result.goal]) for result in found
    ]


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


Place = tuple[int | None, list[float]]
"""Flat index of a configuration, None off the grid, and the value of each axis [m or rad]."""


Server = tuple[int, int]
"""Number of a stop, and of a hand there."""


def _places(
    file: ScoreFile, job: Job, members: Choice | Sequence[int] | InitialConfiguration
) -> tuple[list[Place], list[list[Server]]]:
    """Return the stops, and for each goal from which to try it with which hand, the best first."""
    axes = job.scored_grid.axes
    if isinstance(members, InitialConfiguration):
        values = [value_of(members, axis.name) for axis in axes]
        every: list[list[Server]] = [[] for _ in file.nominal.sets.weights]
        for hand, goals in enumerate(file.goals_of_hands):
            for goal in goals:
                every[goal].append((0, hand))
        return [(None, values)], every
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


def _refined_places(
    file: ScoreFile, job: Job, chosen: RefinedSet
) -> tuple[list[Place], list[list[Server]]]:
    """Return the stops of a refined set of a file, as `_places` does.

    Raises:
        TcsError: If the file has no such set.
    """
    refined = file.tables[chosen.table].refined
    if refined is None or not 0 <= chosen.row < len(refined.origin):
        raise TcsError(f"plan: no refined set {chosen.row}. Refine the file: tcs refine FILE.")
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
    hand = np.zeros(reached.shape, np.uint8)
    if refined.hand is not None:
        hand = refined.hand[chosen.row, rows]
    return places, _by_dexterity(reached, dexterity, hand)


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


def _serving(file: ScoreFile, job: Job, members: Sequence[int]) -> list[list[Server]]:
    """Return the members that reach each goal with their hands, the most dexterous first."""
    reached, dexterity, hand = [], [], []
    for h in members:
        table, row = divmod(h, job.grid.size)
        scores = file.tables[table].scores
        reached.append(scores.reached[row])
        dexterity.append(scores.dexterity[row])
        hand.append(np.zeros(scores.goals, np.uint8) if scores.hand is None else scores.hand[row])
    return _by_dexterity(np.array(reached), np.array(dexterity), np.array(hand))


def _by_dexterity(
    reached: NDArray[np.bool_], dexterity: NDArray[np.float32], hand: NDArray[np.uint8]
) -> list[list[Server]]:
    """Return the members that reach each goal with their hands, the most dexterous first.

    Args:
        reached: Whether a member reaches a goal, shape (m, G).
        dexterity: Its dexterity there, shape (m, G).
        hand: Number of its hand there, shape (m, G).
    """
    return [
        [(n, int(hand[n, goal])) for n in able]
        for goal, able in enumerate(members_by_dexterity(reached, dexterity))
    ]
