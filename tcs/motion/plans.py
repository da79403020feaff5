"""Planning: for each stop of a set, a tour of timed motions through the goals it serves."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from tcs.errors import TcsError
from tcs.kernel.cache import is_compiled
from tcs.motion.motion_plan import GoalResult, MotionPlan
from tcs.motion.recheck import false_pieces
from tcs.motion.stop_tour import plan_stop
from tcs.motion.stops import Stop
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import made_from, rebuild_scene
from tcs.placement.selection import Choice
from tcs.placement.store import ScoreFile

ENTRY = "motion.connect.connect"
"""The function of the planner that takes longest to compile."""


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
        planned, found = plan_stop(stop, h, number, goals)
        results |= {result.goal: result for result in found}
        stops.append(planned)
        for segment in planned.segments:
            for curve in segment.curves:
                edges += curve.pieces
                false += false_pieces(scene, stop.motion, curve)
        if on_progress is not None:
            on_progress(number + 1, len(members))
    return MotionPlan(
        made_from=made_from(file),
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
