"""Plans: for each stop of a set, a tour of timed motions through the goals it serves."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import is_compiled
from tcs.model.grid import InitialConfiguration
from tcs.motion.approach import Access, Accesses, accesses, joint_time
from tcs.motion.curves import Curve
from tcs.motion.paths import find_path, rounded
from tcs.motion.recheck import false_pieces
from tcs.motion.stops import BodyPair, Stop
from tcs.motion.timing import Timed, timed
from tcs.motion.tour import REST, best_tour
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import rebuild_scene
from tcs.placement.selection import Choice
from tcs.placement.store import ScoreFile

ENTRY = "motion.connect.connect"
"""The function of the planner that takes longest to compile."""


@dataclass(frozen=True, eq=False)
class Segment:
    """One motion of a tour."""

    type: str
    """"move", past everything; "approach" or "retreat", straight."""
    start: int | None
    """Goal near which it begins; None for rest. A straight motion begins and ends near one goal."""
    end: int | None
    """Goal near which it ends; None for rest."""
    curves: tuple[Curve, ...]
    """The path; the arm stops between curves."""
    timing: Timed

    def to_json(self) -> dict[str, Any]:
        """Return the segment as plain containers, angles in radians."""
        return {
            "type": self.type,
            "from": "rest" if self.start is None else self.start,
            "to": "rest" if self.end is None else self.end,
            "duration": self.timing.duration,
            "edges": sum(curve.pieces for curve in self.curves),
            "times": self.timing.times.round(6).tolist(),
            # Adding 0.0 turns -0.0 into 0.0.
            "positions": (self.timing.positions.round(9) + 0.0).tolist(),
            "velocities": (self.timing.velocities.round(9) + 0.0).tolist(),
        }


@dataclass(frozen=True)
class GoalResult:
    """What became of one goal."""

    goal: int
    stop: int | None
    """Number of the stop that was to do it; None if no stop reaches it."""
    done: bool
    reason: str
    """"" if done; "unreached", "rest_blocked", "approach_limits", "approach_blocked" or
    "no_path"."""
    pair: BodyPair | None = None
    """The bodies whose contact stood in the way most often."""
    segment: str = ""
    """The segment without a motion, e.g. "rest to goal 3"."""
    seconds: float = field(default=0.0, compare=False)
    """How long it was tried [s]."""

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain containers."""
        plain: dict[str, Any] = {"goal": self.goal, "stop": self.stop, "done": self.done}
        if not self.done:
            plain |= {
                "reason": self.reason,
                "pair": None if self.pair is None else list(self.pair),
                "segment": self.segment,
                "seconds": self.seconds,
            }
        return plain


@dataclass(frozen=True, eq=False)
class StopPlan:
    """The motions at one stop."""

    at: InitialConfiguration
    index: int
    """Flat configuration index."""
    segments: tuple[Segment, ...]
    """In order, from rest to rest; empty if no goal can be done."""
    returns: bool
    """Whether a motion back to rest was found."""

    @property
    def goals(self) -> tuple[int, ...]:
        """Goals that are done, in order."""
        return tuple(s.end for s in self.segments if s.type == "approach" and s.end is not None)

    @property
    def duration(self) -> float:
        """Duration of all segments [s]."""
        return sum(segment.timing.duration for segment in self.segments)

    def to_json(self) -> dict[str, Any]:
        """Return the stop as plain containers."""
        return {
            **self.at.to_json(),
            "configuration": self.index,
            "goals": list(self.goals),
            "returns": self.returns,
            "duration": self.duration,
            "segments": [segment.to_json() for segment in self.segments],
        }


@dataclass(frozen=True, eq=False)
class MotionPlan:
    """The motions that do a task from the stops of a set."""

    joints: tuple[str, ...]
    """Names of the joints, in the order of all joint arrays."""
    stops: tuple[StopPlan, ...]
    results: tuple[GoalResult, ...]
    """What became of each goal of the task, in order."""
    edges: int
    """Number of pieces of curves that Drake re-checked."""
    false: int
    """Number of these that Drake refutes."""
    seed: int
    seconds: float
    """Duration of planning, timing and re-check [s]."""

    @property
    def goals_done(self) -> int:
        """Number of goals done."""
        return sum(result.done for result in self.results)

    def to_json(self) -> dict[str, Any]:
        """Return the plan as plain containers, as `tcs plan --json` prints it."""
        return {
            "joints": list(self.joints),
            "stops": [stop.to_json() for stop in self.stops],
            "goals": len(self.results),
            "goals_reached": sum(result.stop is not None for result in self.results),
            "goals_done": self.goals_done,
            "results": [result.to_json() for result in self.results],
            "verified": {"edges": self.edges, "false": self.false},
            "seed": self.seed,
            "seconds": self.seconds,
        }


def plan(
    file: ScoreFile,
    members: Choice | Sequence[int],
    *,
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
        members: A selected set, or flat configuration indices of the stops in the order of the
            visits; in a file with observed states, those of all its tables one after the other.
        seed: Seed of the planner; the plan is the same for the same seed.
        on_progress: Called with the number of finished stops and their total.
        on_compile: Called before the planner compiles, if it has to.

    Returns:
        The plan; goals without a motion carry the reason.

    Raises:
        StoreMismatchError: If the models differ from those the file was made from.
        RobotError: If a velocity limit of the arm is unknown.
        TcsError: If there is no such configuration.
    """
    begun = time.perf_counter()
    job, scene, _ = rebuild_scene(file)
    if isinstance(members, Choice):
        table = 0 if members.match is None else members.match.index
        members = [table * job.grid.size + members.indices[i] for i in members.order]
    if on_compile is not None and not is_compiled(ENTRY):
        on_compile()
    for h in members:
        if not 0 <= h < job.scored_grid.size:
            raise TcsError(
                f"plan: no configuration {h}; the file has {job.scored_grid.size:,}, from 0."
            )
    serving = _serving(file, job, members)
    results: dict[int, GoalResult] = {
        goal: GoalResult(goal, None, False, "unreached")
        for goal in range(len(job.task.goals))
        if not serving[goal]
    }
    stops, edges, false = [], 0, 0
    for number, h in enumerate(members):
        goals = [
            goal
            for goal, able in enumerate(serving)
            if number in able
            and not (goal in results and results[goal].done)
            # The most dexterous stop serves a goal; later stops take over what it could not do.
            and (able[0] == number or goal in results)
        ]
        stop = Stop.of(job, scene, h, seed)
        planned, found = _plan_stop(stop, h, number, goals)
        results |= {result.goal: result for result in found}
        stops.append(planned)
        for segment in planned.segments:
            for curve in segment.curves:
                edges += curve.pieces
                false += false_pieces(scene, stop.motion, curve)
        if on_progress is not None:
            on_progress(number + 1, len(members))
    return MotionPlan(
        joints=tuple(job.spec.robot.arm_joints),
        stops=tuple(stops),
        results=tuple(results[goal] for goal in range(len(job.task.goals))),
        edges=edges,
        false=false,
        seed=seed,
        seconds=time.perf_counter() - begun,
    )


def _serving(file: ScoreFile, job: Job, members: Sequence[int]) -> list[list[int]]:
    """Return the numbers of the members that reach each goal, the most dexterous first."""
    rows = []
    for h in members:
        table, row = divmod(h, job.grid.size)
        scores = file.tables[table].scores
        rows.append((scores.reached[row], scores.dexterity[row]))
    serving = []
    for goal in range(len(job.task.goals)):
        able = [n for n, (reached, _) in enumerate(rows) if reached[goal]]
        serving.append(sorted(able, key=lambda n: -float(rows[n][1][goal])))
    return serving


def _plan_stop(
    stop: Stop, index: int, number: int, goals: Sequence[int]
) -> tuple[StopPlan, list[GoalResult]]:
    """Plan the tour of one stop through goals."""
    tour = _Tour(stop, number)
    blocked = stop.rest_contact()
    for goal in goals:
        if blocked is not None:
            tour.fail(goal, "rest_blocked", blocked, "rest", time.perf_counter())
            continue
        tour.open(goal)
    for goal, access in tour.order():
        tour.visit(goal, access)
    returns = tour.go_home()
    planned = StopPlan(stop.at, index, tuple(tour.segments), returns)
    return planned, list(tour.results.values())


class _Tour:
    """The tour of one stop while it is planned."""

    def __init__(self, stop: Stop, number: int) -> None:
        self.stop, self.number = stop, number
        self.found: dict[int, Accesses] = {}
        self.results: dict[int, GoalResult] = {}
        self.segments: list[Segment] = []
        self.q = stop.rest
        """Joint angles where the arm is [rad]."""
        self.goal: int | None = None
        """Goal visited last, None at rest."""

    def open(self, goal: int) -> None:
        """Find the postures at a goal that can be approached."""
        begun = time.perf_counter()
        found = accesses(self.stop, goal)
        if found.found:
            self.found[goal] = found
            return
        self.fail(goal, found.reason, found.pair, f"approach of goal {goal}", begun)

    def order(self) -> list[tuple[int, Access]]:
        """Return the goals in the order of the shortest tour in joint time, each with a posture."""
        goals = sorted(self.found)
        lists = [self.found[goal].found for goal in goals]

        def leg(a: int, b: int) -> FloatArray:
            rest = self.stop.rest[None]
            starts = rest if a == REST else np.array([access.end for access in lists[a]])
            ends = rest if b == REST else np.array([access.begin for access in lists[b]])
            return np.array([joint_time(self.stop, start, ends) for start in starts])

        tour = best_tour([len(found) for found in lists], leg)
        return [(goals[number], lists[number][posture]) for number, posture in tour]

    def visit(self, goal: int, access: Access) -> None:
        """Append the motions to a goal, in and out, or note that there are none."""
        begun = time.perf_counter()
        self.stop.forget_contacts()
        chosen, path = access, self._path(access.begin[None])
        if path is None:
            # By another posture at the same goal.
            others = self.found[goal].found
            path = self._path(np.array([other.begin for other in others]))
            chosen = access if path is None else others[path[1]]
        if path is None:
            here = "rest" if self.goal is None else f"goal {self.goal}"
            pair = self.stop.most_frequent_contact()
            self.fail(goal, "no_path", pair, f"{here} to goal {goal}", begun)
            return
        self._move(path[0], goal)
        # Joints without limits may have arrived full turns away.
        offset = self.q - chosen.begin
        for kind, curve in (("approach", chosen.approach), ("retreat", chosen.retreat)):
            curve = curve.shifted(offset)
            self._append(kind, goal, goal, (curve,))
        self.q, self.goal = self.segments[-1].curves[-1].q[-1], goal
        self.results[goal] = GoalResult(goal, self.number, True, "")

    def go_home(self) -> bool:
        """Append the motion back to rest; return whether there is one."""
        if self.goal is None:
            return True
        path = self._path(self.stop.rest[None])
        if path is None:
            return False
        self._move(path[0], None)
        return True

    def _path(self, ends: FloatArray) -> tuple[FloatArray, int] | None:
        return find_path(self.stop, self.q[None], ends)

    def _move(self, path: FloatArray, goal: int | None) -> None:
        curves = tuple(rounded(self.stop, path))
        if curves:
            self._append("move", self.goal, goal, curves)
        self.q = path[-1]

    def _append(
        self, kind: str, start: int | None, end: int | None, curves: tuple[Curve, ...]
    ) -> None:
        parts = [timed(curve, self.stop.velocity, self.stop.acceleration) for curve in curves]
        self.segments.append(Segment(kind, start, end, curves, _joined(parts)))

    def fail(
        self, goal: int, reason: str, pair: BodyPair | None, segment: str, begun: float
    ) -> None:
        """Note that a goal cannot be done."""
        seconds = time.perf_counter() - begun
        self.results[goal] = GoalResult(goal, self.number, False, reason, pair, segment, seconds)


def _joined(parts: Sequence[Timed]) -> Timed:
    """Return timed curves one after the other."""
    times, positions, velocities = [parts[0].times], [parts[0].positions], [parts[0].velocities]
    for part in parts[1:]:
        times.append(times[-1][-1] + part.times[1:])
        positions.append(part.positions[1:])
        velocities.append(part.velocities[1:])
    return Timed(np.concatenate(times), np.concatenate(positions), np.concatenate(velocities))
