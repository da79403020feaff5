"""Scores of goals that name their arms and tools in one file: each hand scores its goals."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import RobotError, TaskError
from tcs.files.mapped import chunks
from tcs.model.scene import SceneSpec
from tcs.model.tasks import Task, partners
from tcs.placement.scoring.arms import filled, shifted
from tcs.placement.scoring.job import BARE, Job
from tcs.placement.scoring.kernel_start import ANALYTIC, NUMERIC
from tcs.placement.scoring.together import Hands, PlacedGoal, together
from tcs.placement.store import HANDS, OF_ARM, ScoreFile
from tcs.placement.tables import Reason, ScoreTable

if TYPE_CHECKING:
    from tcs.placement.scoring.offline import Scored, ScoringSetup


def check_arms_are_free(setups: Sequence[ScoringSetup]) -> None:
    """Check that goals name no arm, so that each arm may be scored at all of them.

    Raises:
        TaskError: If goals name their arm, or several tools.
    """
    if len(setups) > 1 or setups[0].job.hand.arm:
        raise TaskError(
            f"goals of task '{setups[0].job.task.name}' name their hands "
            f"({'; '.join(str(setup.job.hand) for setup in setups)}), so not every arm is scored "
            "at every goal. Leave '--arms' out, or name one arm for the goals that name none."
        )


def score_hands(
    setups: Sequence[ScoringSetup],
    *,
    begun: float,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> ScoreFile:
    """Score the goals of each hand, and return one file with all goals of each configuration.

    Args:
        setups: The job of each hand.
        begun: Start of the work, by `time.perf_counter` [s].
        on_progress: Called with the number of scored configurations and their total.
        on_compile: Called before the kernel compiles, if it has to.

    Raises:
        RobotError: If the arms have different grids: one has a torso joint, another has not.
    """
    jobs = [setup.job for setup in setups]
    for job in jobs:
        if job.grid != jobs[0].grid:
            raise RobotError(
                f"robots '{jobs[0].spec.robot.name}' and '{job.spec.robot.name}' have different "
                "torso joints, so no configuration serves the goals of both. Write a task for each."
            )
    size = jobs[0].scored_grid.size
    parts = [
        setup.scored(
            on_progress=shifted(on_progress, number * size, len(setups) * size),
            on_compile=on_compile,
        )
        for number, setup in enumerate(setups)
    ]
    task = whole_task(jobs)
    numbers = [job.goal_numbers for job in jobs]
    states = [list(of_state) for of_state in zip(*(part.tables for part in parts), strict=True)]
    pairs = pairs_of(task, numbers)
    if pairs:
        hands = Hands([setup.job.lowered(setup.scene) for setup in setups], setups[0].measure)
        rows = jobs[0].grid.size
        states = [
            together(of_state, pairs, hands, first_row=state * rows, jobs=setups[0].jobs)
            for state, of_state in enumerate(states)
        ]
    tables = [joined_goals(of_state, numbers, task.weights) for of_state in states]
    spec = SceneSpec(jobs[0].given_robot, jobs[0].spec.environment)
    whole = dataclasses.replace(jobs[0], task=task, spec=spec, hand=BARE, goal_numbers=())
    entries = _entries(jobs, parts)
    return dataclasses.replace(setups[0], job=whole).file_of(tables, whole.grid, begun, entries)


def pairs_of(
    task: Task, goals: Sequence[Sequence[int]]
) -> tuple[tuple[PlacedGoal, PlacedGoal], ...]:
    """Return the pairs of goals that two arms reach at the same time, each goal by its hand.

    Args:
        task: The whole task.
        goals: Numbers of the goals of each hand.
    """
    places = {
        goal: PlacedGoal(hand, place)
        for hand, numbers in enumerate(goals)
        for place, goal in enumerate(numbers)
    }
    return tuple(
        (places[i], places[j])
        for i, j in enumerate(partners(task.goals))
        if j is not None and i < j
    )


def whole_task(jobs: Sequence[Job]) -> Task:
    """Return the task whose goals are divided among jobs."""
    goals = {
        number: goal
        for job in jobs
        for number, goal in zip(job.goal_numbers, job.task.goals, strict=True)
    }
    contacts = (pair for job in jobs for pair in job.task.allowed_contacts)
    walls = (one for job in jobs for one in job.task.keep_out)
    return dataclasses.replace(
        jobs[0].task,
        goals=tuple(goals[number] for number in sorted(goals)),
        allowed_contacts=tuple(dict.fromkeys(contacts)),
        keep_out=tuple(dict.fromkeys(walls)),
    )


def joined_goals(
    tables: Sequence[ScoreTable],
    goals: Sequence[Sequence[int]],
    weights: NDArray[np.float64],
) -> ScoreTable:
    """Return the scores of all goals as one table.

    Args:
        tables: The scores of each hand.
        goals: Numbers of the goals of each.
        weights: Weights of all goals, sum 1, shape (goals,).
    """
    return filled(
        tables,
        [(0, numbers) for numbers in goals],
        (tables[0].configurations, weights.size),
        weights=weights,
        joints_of=partial(_joints, tables, goals),
    )


def _joints(
    tables: Sequence[ScoreTable], goals: Sequence[Sequence[int]], reason: NDArray[np.uint8]
) -> NDArray[np.float32]:
    """Return the joints of all reached pairs, ordered by configuration and then by goal."""
    joints = np.empty((sum(len(table.arm_joints) for table in tables), 7), np.float32)
    done = [0] * len(tables)
    begin = 0
    for rows in chunks(reason):
        reached = reason[rows] == Reason.REACHED
        place = begin + np.cumsum(reached).reshape(reached.shape) - 1
        for k, (table, numbers) in enumerate(zip(tables, goals, strict=True)):
            columns = list(numbers)
            at = place[:, columns][reached[:, columns]]
            joints[at] = table.arm_joints[done[k] : done[k] + at.size]
            done[k] += at.size
        begin += int(np.count_nonzero(reached))
    return joints


def _entries(jobs: Sequence[Job], parts: Sequence[Scored]) -> dict[str, Any]:
    """Return the entries of the metadata: those of each hand, and what sums them up."""
    of_hands = [
        {
            **job.hand.to_json(),
            "goals": list(job.goal_numbers),
            "description": job.spec.robot.model_dump(mode="json"),
            **{key: part.entries[key] for key in OF_ARM if key in part.entries},
        }
        for job, part in zip(jobs, parts, strict=True)
    ]
    digests = "".join(entry["scene_digest"] for entry in of_hands)
    contacts = (entry["self_contact"] for entry in of_hands)
    timings = [part.entries["timings"] for part in parts]
    return {
        **{key: value for key, value in parts[0].entries.items() if key not in OF_ARM},
        HANDS: of_hands,
        "scene_digest": hashlib.sha256(digests.encode()).hexdigest(),
        "ik": NUMERIC if any(entry["ik"] == NUMERIC for entry in of_hands) else ANALYTIC,
        "self_contact": next((contact for contact in contacts if contact is not None), None),
        "timings": {key: sum(of_hand[key] for of_hand in timings) for key in timings[0]},
    }
